#include "core/planning/ranking/score_map.h"

#include <cstdint>

namespace vantage::planning {

std::vector<ScoredCell> ScoreMap(const Evaluation& evaluation, const FeasibleViews& feasible) {
  std::vector<ScoredCell> map;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    const ViewEstimate& view = evaluation.views[i];
    if (!view.scored) continue;
    map.push_back({feasible.Centre(i).cast<float>(), static_cast<float>(view.score),
                   static_cast<float>(view.lower), static_cast<float>(view.upper)});
  }
  return map;
}

}  // namespace vantage::planning
