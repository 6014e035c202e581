#include "core/planning/problem/planning_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/patches/patches.h"
#include "core/planning/scoring/patch_tree.h"

namespace vantage::planning {
namespace {

// Per voxel of the box: two grids of bits.
constexpr double kGrids = 2.0 / 8;
constexpr double kCounts = 4;
// Per viewcell of the box: why it is not feasible, and its index.
constexpr double kViewcell = 5;
// Per feasible view: its cell and position, estimates twice (interim plans), the map of scores.
constexpr double kView = 250;
// Per cell: the arrays that patches are grown from and sorted into, the table of neighbours, the
// scorer's arrays and their sorted copy, the tree (two nodes per packet).
constexpr double kCell = 3 * sizeof(DeficientCell) + 40 + 2 * 12 * sizeof(float) + 32 +
                         2.0 * sizeof(PatchTree::Node) / CellArrays::kPacket;
// Per column of voxels of the box: where its floors begin, and lines across gaps in them.
constexpr double kColumn = 96;
// Per surface voxel, as if all faced up: candidate, piece, floor twice, whether the scanner fits.
constexpr double kFloor = 80;
// Per surface voxel: the faces between it and what is empty, merged, with Embree's boxes.
constexpr double kFaces = 120;

double Voxels(const model::VoxelBox& box) {
  return box.empty() ? 0 : ((box.max - box.min).cast<double>().array() + 2).prod();
}

double Viewcells(const model::PlanningView& model, const PlanningConfig& config) {
  return Voxels(model.bounds()) /
         std::pow(std::max(1.0, config.viewcell_size / model.voxel_size()), 3);
}

}  // namespace

uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config) {
  const model::VoxelBox& box = model.bounds();
  const double voxels = Voxels(box);
  const double viewcells = Viewcells(model, config);
  const double layers =
      box.empty() ? 1 : std::max(1.0, (box.max.z() - box.min.z()) * model.voxel_size());
  const double views =
      viewcells *
      std::min(1.0, (config.max_viewpoint_height - config.min_viewpoint_height) / layers);
  const auto surface = static_cast<double>(model.SurfaceCount());
  const double columns = box.empty() ? 0 : (box.max - box.min).head<2>().cast<double>().prod();
  double bytes = voxels * kGrids + viewcells * kViewcell + views * kView + columns * kColumn +
                 surface * (kCell + kFaces + kFloor) + (1 << 20);
  if (voxels <= static_cast<double>(AnytimeOptions{}.hierarchy_voxels) || config.pose_sensitivity) {
    bytes += voxels * kCounts;
  }
  return static_cast<uint64_t>(bytes);
}

absl::Status CheckPlanningSize(const model::PlanningView& model, const PlanningConfig& config) {
  const uint64_t bytes = EstimatePlanningMemory(model, config);
  if (bytes > config.memory_limit) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "planning: this model would take up to %.2f GB of memory, more than memory_limit, %.2f GB: "
        "raise it, use larger viewcells or voxels, or split the site",
        static_cast<double>(bytes) / 1e9, static_cast<double>(config.memory_limit) / 1e9));
  }
  if (Viewcells(model, config) > static_cast<double>(std::numeric_limits<int32_t>::max())) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "planning: the model's box has %.1e viewcells of viewcell_size %.3f m, more than can be "
        "indexed: use larger ones, or split the site",
        Viewcells(model, config), config.viewcell_size));
  }
  return absl::OkStatus();
}

}  // namespace vantage::planning
