// How the steps of a plan share its budget.
#ifndef VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_
#define VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_

#include <cstdint>

#include "core/parallel/budget.h"

namespace vantage::planning {

// The part of the budget that step D may use; the rest is kept for ranking and the registration
// check.
parallel::Budget EvaluationShare(const parallel::Budget& budget);

// What step F may use when the evaluation cast `rays`: writing the answer takes time, too.
parallel::Budget CheckShare(const parallel::Budget& budget, uint64_t rays);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_
