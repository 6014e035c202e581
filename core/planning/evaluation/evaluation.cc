#include "core/planning/evaluation/evaluation.h"

#include <algorithm>

namespace vantage::planning {

std::vector<uint32_t> ByScore(const Evaluation& evaluation) {
  std::vector<uint32_t> order;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].scored) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return evaluation.views[a].Rank() > evaluation.views[b].Rank();
  });
  return order;
}

}  // namespace vantage::planning
