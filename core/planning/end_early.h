// The plan that ends before a view was evaluated: its outcome, and at which step what ended it.
#ifndef VANTAGE_CORE_PLANNING_END_EARLY_H_
#define VANTAGE_CORE_PLANNING_END_EARLY_H_

#include "core/parallel/budget.h"
#include "core/planning/plan.h"

namespace vantage {

Plan& EndEarly(Plan& plan, const Budget& budget, const char* during);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_END_EARLY_H_
