// Surface that is expected and that scans looked at, and did not show (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/plan/opening.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// A voxel of surface that is expected, and its surface.
struct ExpectedSurface {
  model::VoxelIndex voxel;
  model::SurfaceVoxel surface;
};

// Those of the bricks in or beside which the model knows space.
std::vector<model::BrickAt> SeenAround(const model::PlanningView& model,
                                       std::span<const model::BrickAt> bricks);

// The surface of `expected` of which `model` knows nothing although one of `stations` looks at it
// with nothing in between: it is glass, a mirror, or not there. `expected`: the model with what is
// expected; of its bricks that differ, those of `changed` are looked at, one voxel of surface in
// `every`. `scanner`: whose scans the
// model is of; of one that sees a sector it is not known where it faced, and there is none.
// CANCELLED when that was requested on the way.
absl::StatusOr<std::vector<ExpectedSurface>> LookedAtInVain(
    const model::PlanningView& model, const model::PlanningView& expected,
    std::span<const model::BrickAt> changed, std::span<const model::Station> stations,
    const sensor::ScannerModel& scanner, const parallel::Cancellation& cancelled, size_t every = 1);

// The stations that look through a doorway of the model: with nothing in between, from no farther
// than what shows what is there.
std::vector<model::Station> StationsBefore(const model::PlanningView& model,
                                           const Opening& doorway);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_
