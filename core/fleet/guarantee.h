// How near a greedy choice of several views is to the best choice (algorithm.md section 11, 'Joint
// planning').
#ifndef VANTAGE_CORE_FLEET_GUARANTEE_H_
#define VANTAGE_CORE_FLEET_GUARANTEE_H_

#include <cstddef>
#include <optional>
#include <string>

namespace vantage::fleet {

// What is recorded while the choice is made.
struct GreedyRecord {
  size_t scanners = 0;
  // The least, over the choices, of what the chosen view scored over the most that any other could
  // have scored instead (upper bound): 1 when every choice was exact.
  double exactness = 1;
  bool alike = true;        // all scanners are of one model and can reach the same views
  bool by_minutes = false;  // ranked by score per minute
  bool waits = false;       // a chosen view needs others' scans to register
  bool crowded = false;     // a view was left out because it stood too near to a chosen one
  bool unchecked = false;   // the limit of checks was reached before every scanner had a view
  bool cut_short = false;   // the budget ended before the choice was complete
};

struct Guarantee {
  std::optional<double> share;  // of the best choice's score; absent: none
  std::string reason;
};

// The score is a monotone submodular function of the set of views. Greedy by a factor `a` (the
// exactness) reaches 1 - (1 - a/k)^k of the best set of k like scanners (Nemhauser, Wolsey and
// Fisher 1978; 1 - 1/e for many), and a / (1 + a) where each scanner has views of its own (a
// partition matroid; Fisher, Nemhauser and Wolsey 1978). Neither holds when views are ranked by
// time, or when a choice changes which views may be chosen later.
Guarantee GuaranteeOf(const GreedyRecord& record);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_GUARANTEE_H_
