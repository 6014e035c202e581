// The plan that ends before a view was evaluated: its outcome, and at which step what ended it.
#ifndef VANTAGE_CORE_PLANNING_END_EARLY_H_
#define VANTAGE_CORE_PLANNING_END_EARLY_H_

#include "core/parallel/budget.h"
#include "core/planning/plan/plan.h"

namespace vantage::planning {

Plan& EndEarly(Plan& plan, const parallel::Budget& budget, const char* during);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_END_EARLY_H_
