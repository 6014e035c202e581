// What a greedy choice of several views is worth against the best one (algorithm.md section 11,
// 'Joint planning').
#ifndef VANTAGE_CORE_FLEET_GUARANTEE_H_
#define VANTAGE_CORE_FLEET_GUARANTEE_H_

#include <cstddef>
#include <optional>
#include <string>

namespace vantage::fleet {

// How the choice was made.
struct GreedyRecord {
  size_t scanners = 0;
  // The least, over the choices, of what the chosen view scored over the most that any other could
  // have scored instead (upper bound): 1 when every choice was exact.
  double exactness = 1;
  bool alike = true;        // every scanner could be sent to the same views and measures the same
  bool by_minutes = false;  // ranked by score per minute
  bool waits = false;       // a chosen view needs others' scans to register
  bool crowded = false;     // a view was left out because it stood too near to a chosen one
  bool unchecked = false;   // as many views as may be were checked before every scanner had one
  bool cut_short = false;   // the budget ended before every scanner was decided on
};

struct Guarantee {
  std::optional<double> share;  // of the best choice's score; absent: none
  std::string reason;
};

// The score is a monotone submodular function of the set of views. Greedy by a factor `a` (the
// exactness) reaches 1 - (1 - a/k)^k of the best set of k like scanners (Nemhauser, Wolsey and
// Fisher 1978; 1 - 1/e for many), and a / (1 + a) where each scanner has views of its own (a
// partition matroid; Fisher, Nemhauser and Wolsey 1978). Neither holds once time or a choice's own
// consequences for what may be chosen later enter.
Guarantee GuaranteeOf(const GreedyRecord& record);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_GUARANTEE_H_
