// Judges whether to stop scanning (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_
#define VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_

#include <optional>

#include "core/planning/evaluation/anytime.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/ranking/gain_bounds.h"

namespace vantage::planning {

// m^2 of deficient surface that no view gains anything on; known when every view was scored on
// every cell.
std::optional<double> UnobservableArea(const PatchSet& patches, const Evaluation& evaluation);

// Judges by upper bounds, never by estimates. `evaluation` may be empty (no feasible view).
// `unobservable_area`: deficient surface that no feasible view gains anything on, m^2; absent when
// unknown. `gains`: of the best view; absent when no view was evaluated.
Termination JudgeTermination(const PatchSet& patches, const Evaluation& evaluation,
                             const PlanningConfig& config, std::optional<double> unobservable_area,
                             const std::optional<GainBounds>& gains);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_TERMINATION_H_
