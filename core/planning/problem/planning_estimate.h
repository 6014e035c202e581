// Estimates a plan's memory before it is taken.
#ifndef VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
#define VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// What a plan's memory depends on, as far as it is known before step A. Surface in the sky counts,
// though it is not planned for.
class PlanningSize {
 public:
  // Looks at all surface once.
  PlanningSize(const model::PlanningView& model, const PlanningConfig& config);
  // As if `other`, which is expected where nothing is known, were beside it: at most as much as
  // both.
  void Add(const PlanningSize& other);

  // The bytes that MakePlan() takes at its peak besides the model, with so many feasible views:
  // those of a plan that comes to score every view, on a few threads. Within a fifth where a plan
  // takes 100 MB and more.
  uint64_t Bytes(double views) const;
  // Upper bound of the number of feasible views: the viewcells at an allowed height, if there were
  // floor wherever there may be.
  double most_views() const { return viewcells_; }

 private:
  double column_bytes_ = 0;  // of columns of voxels, in the plan of the model's box
  double floor_ = 0;         // voxels, at most
  double viewcells_ = 0;     // at an allowed height, at most
  double deficient_ = 0;     // cells that stand for them where they are deficient
  double measured_ = 0;      // of these
  double cubes_ = 0;         // bytes that cells take more where they stand for more than a voxel
  double scene_ = 0;         // bytes, of what rays meet, and of asking
  double tables_ = 0;        // bytes, of summed volumes
};

// Upper bound of the bytes that MakePlan() needs: as if it were possible to stand everywhere.
uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config);

// RESOURCE_EXHAUSTED when a plan with so many feasible views would take more than
// config.memory_limit, or there may be more viewcells than can be indexed; the message names the
// limit and what to change.
absl::Status CheckPlanningSize(const PlanningSize& size, const PlanningConfig& config,
                               size_t views = 0);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
