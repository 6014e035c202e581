// Whether the scanner could register with the required accuracy from anywhere (algorithm.md section
// 9, 'What the instrument shows').
#ifndef VANTAGE_CORE_PLANNING_RANKING_INSTRUMENT_LIMIT_H_
#define VANTAGE_CORE_PLANNING_RANKING_INSTRUMENT_LIMIT_H_

#include <cstdint>
#include <optional>

#include "core/parallel/budget.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"

namespace vantage::planning {

struct InstrumentLimit {
  // Where the required accuracy cannot be met with the instrument: the bound that can, m.
  std::optional<double> attainable;
  uint64_t rays = 0;  // that it took to find out
};

// Where every view that was checked was refused for a bound beyond what is required, asks it of
// scans that would be made where stations are, which overlap by all that is known around them
// (registration::AttainableInstead()); the smallest of their bounds counts. Heeds of the budget
// only whether it was cancelled: that is sixteen predictions at most.
InstrumentLimit FindInstrumentLimit(const PlanningProblem& problem, const RegistrationCheck& check,
                                    const parallel::Budget& budget);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_INSTRUMENT_LIMIT_H_
