#include "core/planning/end_early.h"

#include "absl/strings/str_cat.h"

namespace vantage::planning {

Plan& EndEarly(Plan& plan, const parallel::Budget& budget, const char* during) {
  plan.outcome =
      budget.cancelled.stop_requested() ? PlanOutcome::kCancelled : PlanOutcome::kSearchUnfinished;
  plan.message =
      absl::StrCat(budget.WhyEnded(), " during '", during, "', before any view was evaluated");
  plan.termination.reason = "not known: no view was evaluated";
  return plan;
}

}  // namespace vantage::planning
