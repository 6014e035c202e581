// When to stop, and what was covered (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_TERMINATION_H_
#define VANTAGE_CORE_PLANNING_TERMINATION_H_

#include <optional>

#include "core/planning/anytime.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"

namespace vantage {

// Judges by upper bounds, never by estimates. `evaluation` may be empty (nothing was feasible).
// `unseeable_area` (m^2): needy surface that gains nothing from any feasible view, where known.
Termination JudgeTermination(const PatchSet& patches, const Evaluation& evaluation,
                             const PlanningConfig& config, std::optional<double> unseeable_area);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_TERMINATION_H_
