#include "core/planning/setting_choice.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/planning/outcome.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::planning {
namespace {

// An equal share of what is left for the options that are left. Each plan counts its rays from 0.
parallel::Budget ShareOf(const parallel::Budget& budget, size_t left, uint64_t rays) {
  if (left == 1 && rays == 0) return budget;
  parallel::Budget part = budget.Part(1 / static_cast<double>(left), rays);
  if (part.work_limit != std::numeric_limits<uint64_t>::max()) part.work_limit -= rays;
  return part;
}

void Name(const SettingOption& option, std::vector<RankedView>& views) {
  for (RankedView& view : views) {
    view.setting = option.name;
    view.scan_minutes = option.minutes;
    view.score_per_minute = view.score / (kSetUpMinutes + option.minutes);
  }
}

// The best first, at most `most`, each `separation` (m) from those before it.
std::vector<RankedView> BestByTheMinute(std::vector<RankedView> views, size_t most,
                                        double separation) {
  std::stable_sort(views.begin(), views.end(), [](const RankedView& a, const RankedView& b) {
    return *a.score_per_minute > *b.score_per_minute;
  });
  std::vector<RankedView> best;
  for (RankedView& view : views) {
    if (best.size() >= most) break;
    const bool near = std::any_of(best.begin(), best.end(), [&](const RankedView& other) {
      return (other.position - view.position).norm() < separation;
    });
    if (!near) best.push_back(std::move(view));
  }
  return best;
}

}  // namespace

absl::StatusOr<Plan> MakePlanChoosingSetting(const model::PlanningView& model,
                                             std::span<const SettingOption> options,
                                             const PlanningConfig& config,
                                             const parallel::Budget& budget,
                                             parallel::Parallel& parallel, PlanProgress progress,
                                             const std::shared_ptr<const ExpectedSite>& site) {
  if (options.empty()) return absl::InvalidArgumentError("name at least one setting");
  Plan plan;
  std::vector<RankedView> views;
  std::vector<RankedView> refused;
  std::shared_ptr<const PlanningProblem> previous;
  double most = 0;    // upper bound of any view's score for each minute, samples
  bool open = false;  // nothing is known of some option's views
  // The bounds of all plans hold together.
  PlanningConfig each = config;
  each.confidence = 1 - (1 - config.confidence) / static_cast<double>(options.size());
  for (size_t i = 0; i < options.size(); ++i) {
    const parallel::Budget part = ShareOf(budget, options.size() - i, plan.rays);
    Plan made;
    // The first is prepared whatever that takes: one setting's answer is better than none.
    auto problem = PlanningProblem::Prepare(
        {model, options[i].scanner, each, previous.get(), site}, parallel,
        i == 0 ? parallel::Cancellation(budget.cancelled) : parallel::Cancellation(part));
    if (problem.ok()) {
      previous = *problem;
      made = MakePlan(**problem, part, parallel, [&](const Plan& so_far) {
        if (i == 0) progress(so_far);
      });
    } else if (absl::IsCancelled(problem.status())) {
      made = EndedPreparing(problem.status().message(), model, each, part);
    } else {
      return problem.status();
    }
    Name(options[i], made.views);
    Name(options[i], made.refused);
    const double minutes = kSetUpMinutes + options[i].minutes;
    if (!made.views.empty()) {
      const double gap = std::min(made.optimality_gap, 1 - 1e-9);
      most = std::max(most, made.views.front().lower / (1 - gap) / minutes);
    } else if (made.termination.best_upper.has_value()) {
      most = std::max(most, *made.termination.best_upper / minutes);
    } else {
      open = open || !made.complete;
    }
    views.insert(views.end(), made.views.begin(), made.views.end());
    refused.insert(refused.end(), made.refused.begin(), made.refused.end());
    if (i == 0) {
      plan = std::move(made);
      continue;
    }
    plan.rays += made.rays;
    plan.complete = plan.complete && made.complete;
    for (size_t stage = 0; stage < plan.seconds.size(); ++stage) {
      plan.seconds[stage] += made.seconds[stage];
    }
    // What the first option left open another may have answered.
    if (plan.outcome != PlanOutcome::kViews && made.outcome == PlanOutcome::kViews) {
      Conclude({made.outcome, made.message}, plan);
    }
  }
  plan.confidence = plan.complete ? 1 : config.confidence;
  const auto wanted = static_cast<size_t>(config.candidates);
  plan.views = BestByTheMinute(std::move(views), wanted, config.candidate_separation);
  plan.refused = BestByTheMinute(std::move(refused), wanted, config.candidate_separation);
  if (plan.outcome == PlanOutcome::kViews) {
    Conclude(ViewsBySetting(plan.views.size(), options.size()), plan);
    const RankedView& first = plan.views.front();
    const double rate = first.lower / (kSetUpMinutes + *first.scan_minutes);
    plan.optimality_gap = open ? 1 : most > 0 ? std::clamp(1 - rate / most, 0.0, 1.0) : 0;
  }
  return plan;
}

}  // namespace vantage::planning
