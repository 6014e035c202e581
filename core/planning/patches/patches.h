// Steps B and C: deficient surface, grouped into planar patches and ranked (algorithm.md
// section 7).
#ifndef VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_
#define VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/patches/deficient_cells.h"
#include "core/planning/plan/copy_on_write_vector.h"
#include "core/planning/plan/patch.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// How far a patch may stray from its plane.
struct PatchTolerance {
  double angle = 0.35;   // rad, of a cell's normal from the plane's
  double offset = 0.75;  // edges of what a cell stands for, of its position from the plane
};

struct PatchSet {
  DeficientCells cells;                   // those of a patch side by side, patches in order
  CopyOnWriteVector<Patch> patches;       // before ranking: in the order of their first cells
  std::vector<Eigen::Vector3f> dropouts;  // m, model frame
  double area = 0;                        // m^2, of all cells
  // Voxels, the edge of the cube that a cell stands for: 1, or 2, 4 or 8 where there are more
  // deficient voxels than PlanningConfig::max_cells (algorithm.md section 7B).
  int cube = 1;
};

// B. Each deficient voxel is in exactly one patch, by itself or by the cell that stands for it; a
// patch is connected (26 neighbours), of one kind, and planar within the tolerance. `told`: m,
// where it is known by other means what is behind false surface, so that no depth counts there.
// CANCELLED when that was requested on the way.
absl::StatusOr<PatchSet> ExtractPatches(const model::PlanningView& model,
                                        const PlanningConfig& config,
                                        const PatchTolerance& tolerance = {},
                                        const parallel::Cancellation& cancelled = {},
                                        const Region& told = {});

// C. The patches by importance = weight * deficit, the most important first, and the cells with
// them. CANCELLED when that was requested on the way.
absl::StatusOr<PatchSet> RankPatches(const PlanningConfig& config, PatchSet set,
                                     const parallel::Cancellation& cancelled = {});

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_
