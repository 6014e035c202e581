// Finds the openings of a site: the doorways, passages and windows that lead from known space on
// (algorithm.md section 7D).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_OPENINGS_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_OPENINGS_H_

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/plan/opening.h"

namespace vantage::planning {

// A function of the model and its floors. Where floors are given and not found, there is no telling
// a doorway from a window: there are no openings. CANCELLED when that was requested on the way.
absl::StatusOr<Openings> FindOpenings(const model::PlanningView& model, const FloorMap& floor,
                                      const parallel::Cancellation& cancelled = {});

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_OPENINGS_H_
