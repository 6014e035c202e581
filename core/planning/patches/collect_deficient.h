// Which voxels are deficient, and the cells that plans know them by: one for each voxel, or, where
// there are too many, one for those that lie together (algorithm.md section 7B).
#ifndef VANTAGE_CORE_PLANNING_PATCHES_COLLECT_DEFICIENT_H_
#define VANTAGE_CORE_PLANNING_PATCHES_COLLECT_DEFICIENT_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/model/view/surface_voxels.h"
#include "core/parallel/cancellation.h"
#include "core/planning/patches/deficient_cells.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// What is required of a surface voxel that is deficient, unless it lies in the sky. Nothing where
// it is not deficient.
std::optional<Requirement> Lacking(const PlanningConfig& config, const model::PlanningView& model,
                                   const model::VoxelIndex& voxel,
                                   const model::SurfaceVoxel& surface);

// About how many cells are left of so many deficient voxels where each stands for a cube of 2^shift
// voxels.
double CellsOfCubes(size_t deficient, int shift);
// The least shift that leaves about `max_cells`; 3 at most, since cubes do not cross bricks.
int CubeShift(size_t deficient, size_t max_cells);
// The same of a model. Nothing when cancelled on the way.
std::optional<int> CubeShiftOf(const model::PlanningView& model, const PlanningConfig& config,
                               const parallel::Cancellation& cancelled);

// The deficient voxels, in the model's order, with the dropouts that their rays had. With a shift
// of 1 to 3 one cell stands for all voxels of a kind that lie in a cube, face the same of six ways
// and have the same requirement: that next to their middle, with the area of all and their mean
// density. Voxels with dropouts stand for themselves. Then cells come brick by brick, and in a
// brick cube by cube. `told`: as for ExtractPatches(). Nothing when cancelled on the way.
std::optional<DeficientCells> CollectDeficient(const model::PlanningView& model,
                                               const PlanningConfig& config, int shift,
                                               const Region& told,
                                               std::vector<Eigen::Vector3f>& dropouts,
                                               const parallel::Cancellation& cancelled);

// The success probability of algorithm.md section 4, 'What never comes', after `failures` attempts
// that failed: 1 / (2 + f), normalised to 1 for no attempt. Successes do not matter, since surface
// that was measured is not deficient.
double SuccessProbability(int missed);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_COLLECT_DEFICIENT_H_
