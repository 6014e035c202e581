// What a plan shows while its views are evaluated (algorithm.md section 6, 'Always an answer').
#ifndef VANTAGE_CORE_PLANNING_RANKING_INTERIM_PLANS_H_
#define VANTAGE_CORE_PLANNING_RANKING_INTERIM_PLANS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/view_report.h"

namespace vantage::planning {

// The first view of each plan is one that registers, where any that was checked does: step F of the
// best views so far, interleaved with step D, for a quarter of its time that is left at most. Keeps
// the references. What it checks counts in nobody's work limit; the final plan need not check it
// again, and is the same otherwise.
class InterimPlans {
 public:
  InterimPlans(const PlanningProblem& problem, const ViewReport& report, const Plan& base,
               const parallel::Budget& budget, parallel::Parallel& parallel, KnownVerdicts& known)
      : problem_(problem),
        report_(report),
        base_(base),
        budget_(budget),
        parallel_(parallel),
        known_(known) {}

  // The best views so far: the best that is known to register first, as it will be described in the
  // end, then others, unchecked.
  Plan Of(const Evaluation& so_far);

 private:
  // Checks what leads now, unless it was.
  void CheckBest(const Evaluation& so_far);

  const PlanningProblem& problem_;
  const ViewReport& report_;
  const Plan& base_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  KnownVerdicts& known_;
  bool looked_ = false;
  std::optional<uint32_t> first_;  // the view that `described_` is
  RankedView described_;
  std::vector<uint32_t> refused_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_INTERIM_PLANS_H_
