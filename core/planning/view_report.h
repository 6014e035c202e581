// Candidate views in the form in which they are handed out (algorithm.md section 11, 'Findable
// answers').
#ifndef VANTAGE_CORE_PLANNING_VIEW_REPORT_H_
#define VANTAGE_CORE_PLANNING_VIEW_REPORT_H_

#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/model/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/anytime.h"
#include "core/planning/feasible_views.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"
#include "core/planning/registration_check.h"
#include "core/planning/scoring.h"

namespace vantage {

// PlanningConfig::Validate and what depends on the model besides.
absl::Status ValidateFor(const PlanningView& model, const ScannerModel& scanner,
                         const PlanningConfig& config);

// References are kept.
class ViewReport {
 public:
  ViewReport(const PlanningView& model, const OpaqueGrid& grid, const FeasibleViews& feasible,
             const PatchSet& patches, const Scoring& scoring)
      : model_(model), grid_(grid), feasible_(feasible), patches_(patches), scoring_(scoring) {}

  // The first `count` of `checked`, in order. Gains are split exactly; where the budget expires
  // before that, gain_by_kind and patches stay empty.
  std::vector<RankedView> Describe(std::span<const CheckedView> checked,
                                   const Evaluation& evaluation, size_t count, const Budget& budget,
                                   Parallel& parallel) const;

  // A position's own figures, gain split included; any position, feasible or not. An unfinished
  // score leaves gain and patches empty and returns false.
  bool Exact(const Eigen::Vector3d& position, const Budget& budget, RankedView& view) const;

  // What can be said while the evaluation goes on: the best views so far, unchecked. Patches and
  // score map come with the final plan only.
  Plan Interim(const Plan& base, const Evaluation& evaluation, const PlanningConfig& config) const;

  // Where a position is: height, clearance, way from the last stand.
  void Place(const Eigen::Vector3d& position, RankedView& view) const;

 private:
  const PlanningView& model_;
  const OpaqueGrid& grid_;
  const FeasibleViews& feasible_;
  const PatchSet& patches_;
  const Scoring& scoring_;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_VIEW_REPORT_H_
