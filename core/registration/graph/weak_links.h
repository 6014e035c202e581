// Where a graph is weak, and what would strengthen it (algorithm.md section 9, 'Weak links').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_WEAK_LINKS_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_WEAK_LINKS_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/connectivity/connectivity.h"
#include "core/registration/graph/adjust.h"
#include "core/registration/graph/pose_graph.h"

namespace vantage::registration {

// Scans that only one link, or one scan, ties to the rest, and how well.
struct WeakLink {
  size_t link = 0;            // of graph.links()
  bool bridge = false;        // without it the graph is in more pieces
  double relative_sigma = 0;  // m, after adjustment: of where b is seen from a, worst direction
  size_t hangs_on = 0;        // scans that it alone ties to the rest, the fewer of both sides
};

// A link that is not there and would help.
struct TieAdvice {
  size_t a = 0;  // of graph.nodes(), a < b
  size_t b = 0;
  double distance = 0;      // m, between the scanners
  double worst_before = 0;  // m, position sigma of the worst scan
  double worst_after = 0;   // m, the same with the tie
  std::string words;        // 'tie scan-7 to scan-2: ...'
};

struct WeakLinks {
  std::vector<WeakLink> links;    // weakest first, at most kMostWeakLinks
  std::vector<TieAdvice> advice;  // the best first, at most kMostAdvice; each lowers the worst
                                  // sigma by a tenth or more
  // Of each of graph.links(), m: how well one scan is known as the other sees it, one sigma in the
  // worst direction, by as much of the link as counts (half of it where a registration to the model
  // goes along); by the whole graph where the link leaves a direction open.
  // 0 of links in doubt, of those that say nothing, and of registrations to the model.
  std::vector<double> sigmas;
  // Of graph.nodes() by links that count, as of `sigmas`; bridges are numbered as graph.links().
  connectivity::Connectivity connectivity;
  size_t worst_scan = 0;   // of graph.nodes(); 0 where there are none
  double worst_sigma = 0;  // m
};

inline constexpr size_t kMostWeakLinks = 10;
inline constexpr size_t kMostAdvice = 5;

// Registrations to the model (LinkOrigin::kModel) count in all sigmas and are no ties themselves.
// Sigmas here are without the errors that all links of a scan share, which no tie lowers.
// `adjustment` is of the same graph. Pairs farther from each other than `farthest` (m, > 0; how far
// scans overlap: half of the range that surfaces are seen from) are not advised.
// INVALID_ARGUMENT: `farthest` is not positive and finite, or the adjustment is of another graph.
absl::StatusOr<WeakLinks> FindWeakLinks(const PoseGraph& graph, const Adjustment& adjustment,
                                        double farthest);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_WEAK_LINKS_H_
