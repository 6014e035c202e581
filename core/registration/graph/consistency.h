// Links in doubt, decided by whether they agree with each other and with what is certain
// (algorithm.md section 9, 'Links in doubt').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_CONSISTENCY_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_CONSISTENCY_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/graph/pose_graph.h"

namespace vantage::registration {

enum class LinkDecision : uint8_t {
  kCertain,   // was not in doubt
  kAccepted,  // consistent with the rest, and no alternative is
  kRejected,  // contradicts what is certain, or what was accepted
  kOpen,      // may be right: an alternative fits about as well, or nothing checks it
};

struct LinkJudgement {
  LinkDecision decision = LinkDecision::kCertain;
  std::string reason;     // in words, of links that were in doubt
  size_t agrees = 0;      // pairs of other scans whose links in the largest set agree with it
  double chain_test = 0;  // chi2 of the loop that it closes with certain links, over its 99.9 %
                          // quantile; 0 where they do not close one
};

struct LinkDecisions {
  std::vector<LinkJudgement> links;  // as graph.links()
  std::vector<bool> keep;            // certain or accepted: for PoseGraph::WithLinks()
  size_t largest_set = 0;            // links that agree, of which each two do
  size_t largest_bound = 0;  // no such set is larger; more than `largest_set` where time ran out
};

// Pairwise consistent measurement sets (Mangelson and others 2018): every two links in doubt are
// compared by the loop that they close with certain links; a largest set of links that all agree is
// found. That is not enough: where a site repeats itself, wrong links agree with each other as well
// as right ones do. So a link of the set is accepted only where
// - it contradicts nothing that is certain, and what is certain would notice if it were off by
//   kLeastPeriod;
// - links between other scans agree with it, more closely than what is certain could tell; or
//   alternatives to it are in the graph and all contradict what is certain;
// - no other set of links, and no other link between the same scans, is supported about as well,
//   unless what is certain decides between them.
// Where the poses at which a scan may have been made instead are known, they have to be in the
// graph, as links in doubt. Depends on the set of nodes and links alone. Errors as Adjust()'s;
// RESOURCE_EXHAUSTED: more than kMostDoubtfulLinks in doubt.
absl::StatusOr<LinkDecisions> DecideLinks(const PoseGraph& graph);

// m: nothing in a building that repeats itself does so more closely and is large enough to hold a
// scan: the narrowest bays of pillars, doors and desks.
inline constexpr double kLeastPeriod = 1.2;
inline constexpr size_t kMostDoubtfulLinks = 400;

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_CONSISTENCY_H_
