#include "core/planning/ranking/optimality_gap.h"

#include <algorithm>
#include <cstdint>

namespace vantage::planning {

double OptimalityGap(const PlanningProblem& problem, const Evaluation& evaluation,
                     const RegistrationCheck& check, const std::vector<RankedView>& returned) {
  const FeasibleViews& feasible = problem.feasible();
  const double separation = problem.config().candidate_separation;
  double most = 0;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].upper <= most) continue;
    const bool refused =
        std::any_of(
            check.refused.begin(), check.refused.end(),
            [&](const CheckedView& other) {
              return i == other.view ||
                     (!other.alone &&
                      (feasible.Centre(i) - feasible.Centre(other.view)).norm() < separation);
            }) ||
        std::find(check.refused_around.begin(), check.refused_around.end(), i) !=
            check.refused_around.end();
    if (refused) continue;
    // A view that was checked gains what its best heading that registers gains.
    const auto facing = std::find_if(check.facing.begin(), check.facing.end(),
                                     [&](const CheckedView& checked) { return checked.view == i; });
    most = std::max(most, facing != check.facing.end() ? facing->score : evaluation.views[i].upper);
  }
  if (most <= 0) return 0;
  if (returned.empty()) return 1;
  return std::clamp(1 - returned.front().lower / most, 0.0, 1.0);
}

}  // namespace vantage::planning
