#include "core/planning/ranking/interim_plans.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/planning/ranking/rank_views.h"

namespace vantage::planning {
namespace {

// Of the views that lead now, so many are checked at the first look, and each time once one is
// known to register: what follows finds out about the rest.
constexpr size_t kLeading = 4;
// Of what is left of the evaluation: where nothing registers, checking would take all of it.
constexpr double kShare = 0.25;

}  // namespace

void InterimPlans::CheckBest(const Evaluation& so_far) {
  const PlanningConfig& config = problem_.config();
  const size_t most = std::exchange(looked_, true) && !first_.has_value()
                          ? static_cast<size_t>(config.max_checked)
                          : kLeading;
  const std::vector<uint32_t> leading =
      RankViews(so_far, problem_.feasible(), config.candidate_separation, most, refused_);
  if (leading.empty() || leading.front() == first_) return;
  const parallel::Budget part = budget_.Part(kShare, 0);
  const RegistrationCheck check =
      CheckRegistration(problem_, problem_.overlap(), so_far, leading, 1, part, parallel_, &known_);
  for (const CheckedView& view : check.refused) refused_.push_back(view.view);
  if (check.registrable.empty()) return;
  const CheckedView& best = check.registrable.front();
  if (first_.has_value() && so_far.views[*first_].Rank() >= so_far.views[best.view].Rank()) return;
  std::vector<RankedView> described =
      report_.Describe(check.registrable, so_far, 1, budget_, parallel_);
  if (described.empty()) return;
  first_ = best.view;
  described_ = std::move(described.front());
}

Plan InterimPlans::Of(const Evaluation& so_far) {
  CheckBest(so_far);
  Plan plan = report_.Interim(base_, so_far);
  const double separation = problem_.config().candidate_separation;
  const auto refused = [&](const RankedView& view) {
    return std::any_of(refused_.begin(), refused_.end(),
                       [&](uint32_t i) { return problem_.feasible().Centre(i) == view.position; });
  };
  std::erase_if(plan.views, [&](const RankedView& view) {
    return refused(view) ||
           (first_.has_value() && (view.position - described_.position).norm() < separation);
  });
  if (!first_.has_value()) return plan;
  plan.views.insert(plan.views.begin(), described_);
  const auto wanted = static_cast<size_t>(problem_.config().candidates);
  if (plan.views.size() > wanted) plan.views.resize(wanted);
  const double most = plan.termination.best_upper.value_or(0);
  plan.optimality_gap = most > 0 ? std::clamp(1 - described_.lower / most, 0.0, 1.0) : 1;
  return plan;
}

}  // namespace vantage::planning
