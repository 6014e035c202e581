// When to stop, and what was covered (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_
#define VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_

#include <optional>

#include "core/planning/evaluation/anytime.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// m^2 of deficient surface that no view gains anything on; known when every view was scored on
// every cell.
std::optional<double> UnobservableArea(const PatchSet& patches, const Evaluation& evaluation);

// Judges by upper bounds, never by estimates. `evaluation` may be empty (nothing was feasible).
// `unobservable_area` (m^2): deficient surface that gains nothing from any feasible view, where
// known.
Termination JudgeTermination(const PatchSet& patches, const Evaluation& evaluation,
                             const PlanningConfig& config, std::optional<double> unobservable_area);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_
