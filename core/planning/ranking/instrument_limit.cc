#include "core/planning/ranking/instrument_limit.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/registration/bound/instrument_limit.h"
#include "core/registration/bound/prediction.h"

namespace vantage::planning {
namespace {

// The newest stations that are asked, a choice: each takes as long as the check of a view.
constexpr size_t kMostStationsAsked = 16;

}  // namespace

InstrumentLimit FindInstrumentLimit(const PlanningProblem& problem, const RegistrationCheck& check,
                                    const parallel::Budget& budget) {
  InstrumentLimit limit;
  const registration::RegistrationConfig& config = problem.config().registration;
  if (!check.registrable.empty() || check.refused.empty()) return limit;
  const bool met =
      std::any_of(check.refused.begin(), check.refused.end(), [&](const CheckedView& view) {
        return registration::kBoundMargin * view.verdict.judged_bound <= config.required_accuracy;
      });
  if (met) return limit;
  // As soon as nothing registers, why is what the plan is good for: whatever time is left.
  parallel::Budget untimed = budget;
  untimed.deadline = parallel::Budget::Clock::time_point::max();
  const std::vector<model::Station>& stations = problem.model().stations();
  const size_t asked = std::min(stations.size(), kMostStationsAsked);
  for (size_t k = stations.size() - asked; k < stations.size(); ++k) {
    const auto at =
        problem.overlap().BoundsAt(stations[k].position, problem.scene(), config, untimed);
    if (!at.has_value()) return {std::nullopt, limit.rays};
    limit.rays += at->rays;
    if (registration::kBoundMargin * at->bounds.bound <= config.required_accuracy) {
      return {std::nullopt, limit.rays};
    }
    const std::optional<double> attainable =
        registration::AttainableInstead(at->bounds, problem.scanner(), config);
    if (!attainable.has_value()) continue;
    limit.attainable = std::min(limit.attainable.value_or(*attainable), *attainable);
  }
  return limit;
}

}  // namespace vantage::planning
