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
  size_t agrees = 0;      // other links in doubt, between other pairs, that agree with it
  double chain_test = 0;  // chi2 of six of the loop that it closes with certain links, over its
                          // 99.9 % quantile; 0 where they do not close one
};

struct LinkDecisions {
  std::vector<LinkJudgement> links;  // as graph.links()
  std::vector<bool> keep;            // certain or accepted: for PoseGraph::WithLinks()
  bool exact = true;  // false: a largest consistent set was approximated, by `largest_bound`
  size_t largest_found = 0;
  size_t largest_bound = 0;
};

// Pairwise consistent measurement sets (Mangelson and others 2018): every two links in doubt are
// compared by the loop that they close with certain links; a largest set of links that all agree is
// found. It is accepted only where it contradicts nothing that is certain and no other set, of
// alternatives to its links, is about as good: periodic sites give wrong links that agree with each
// other. Depends on the set alone. INVALID_ARGUMENT as Adjust(), RESOURCE_EXHAUSTED: more than
// kMostDoubtfulLinks in doubt.
absl::StatusOr<LinkDecisions> DecideLinks(const PoseGraph& graph);

inline constexpr size_t kMostDoubtfulLinks = 2000;

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_CONSISTENCY_H_
