#include "core/planning/problem/planning_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"
#include "core/planning/patches/patches.h"
#include "core/planning/scoring/patch_tree.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {
namespace {

// Per viewcell at an allowed height over a floor: why it is not feasible, and its index.
constexpr double kViewcell = 5;
// Per feasible view: its cell and position, estimates twice (interim plans), the map of scores.
constexpr double kView = 250;
// Per cell: the array in which patches are grown and sorted, with room to grow, their numbers, the
// table of neighbours, the scorer's arrays and their sorted copy, what they are sorted by, the tree
// (two nodes per packet).
constexpr double kCell = 2 * sizeof(DeficientCell) + 8 + 12 +
                         2 * (16 * sizeof(float) + sizeof(SkylineSines)) + 32 +
                         2.0 * sizeof(PatchTree::Node) / CellArrays::kPacket;
// Per column of voxels of the box: where its floors begin, three times.
constexpr double kColumn = 12;
// Per voxel of floor: candidate, piece, floor twice, whether the scanner fits, lines across gaps.
constexpr double kFloor = 160;
// Per surface voxel: the faces between it and what is empty, merged, with Embree's boxes.
constexpr double kFaces = 120;

// Bounds of numbers that only step A finds. The columns of voxels are those of the box; there is
// floor in as many at most as have surface, or everywhere where it was given.
struct Size {
  double columns = 0;
  double floor = 0;      // voxels
  double viewcells = 0;  // at an allowed height
};

Size SizeOf(const model::PlanningView& model, const PlanningConfig& config) {
  Size size;
  if (model.bounds().empty()) return size;
  size.columns = (model.bounds().max - model.bounds().min).head<2>().cast<double>().prod();
  size.floor = config.floor_z.has_value()
                   ? size.columns
                   : std::min(size.columns, static_cast<double>(model.SurfaceCount()));
  const double voxels_per_cell = std::max(1.0, config.viewcell_size / model.voxel_size());
  const double layers = (config.max_viewpoint_height - config.min_viewpoint_height) /
                            (voxels_per_cell * model.voxel_size()) +
                        1;
  size.viewcells = size.floor / (voxels_per_cell * voxels_per_cell) * layers;
  return size;
}

}  // namespace

uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config) {
  const Size size = SizeOf(model, config);
  const auto surface = static_cast<double>(model.SurfaceCount());
  const model::VoxelBox box = visibility::OpaqueGrid(model).box();
  // Pose sensitivity and the hierarchy have a table each.
  const uint64_t tables =
      (config.pose_sensitivity ? 2 : 1) * visibility::SummedVolumeTable::Bytes(box.max - box.min);
  return static_cast<uint64_t>(size.viewcells * (kViewcell + kView) + size.columns * kColumn +
                               size.floor * kFloor + surface * (kCell + kFaces) + (1 << 20)) +
         tables;
}

absl::Status CheckPlanningSize(const model::PlanningView& model, const PlanningConfig& config) {
  const uint64_t bytes = EstimatePlanningMemory(model, config);
  if (bytes > config.memory_limit) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "planning: this model would take up to %.2f GB of memory, more than memory_limit, %.2f GB: "
        "raise it, use larger viewcells or voxels, or split the site",
        static_cast<double>(bytes) / 1e9, static_cast<double>(config.memory_limit) / 1e9));
  }
  const double viewcells = SizeOf(model, config).viewcells;
  if (viewcells > static_cast<double>(std::numeric_limits<int32_t>::max())) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "planning: the model may have %.1e viewcells of viewcell_size %.3f m, more than can be "
        "indexed: use larger ones, or split the site",
        viewcells, config.viewcell_size));
  }
  return absl::OkStatus();
}

}  // namespace vantage::planning
