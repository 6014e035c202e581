// Candidate views in the form in which they are handed out (algorithm.md section 11).
#ifndef VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_
#define VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_

#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"

namespace vantage::planning {

// Keeps the reference.
class ViewReport {
 public:
  explicit ViewReport(const PlanningProblem& problem) : problem_(problem) {}

  // The first `count` of `checked`, in order. Scores are split exactly; where the budget expires
  // before that, score_by_kind and patch_scores stay empty.
  std::vector<RankedView> Describe(std::span<const CheckedView> checked,
                                   const Evaluation& evaluation, size_t count,
                                   const parallel::Budget& budget,
                                   parallel::Parallel& parallel) const;

  // A position's own figures, the split of its score included; any position, feasible or not. An
  // unfinished score leaves the split empty and returns false.
  bool Exact(const Eigen::Vector3d& position, const parallel::Budget& budget,
             RankedView& view) const;

  // What can be said while the evaluation goes on: the best views so far, unchecked. Patches and
  // score map come with the final plan only.
  Plan Interim(const Plan& base, const Evaluation& evaluation) const;

  // Where a position is: height, clearance, way from the last station.
  void Place(const Eigen::Vector3d& position, RankedView& view) const;

 private:
  const PlanningProblem& problem_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_
