#include "core/planning/problem/planning_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"
#include "core/planning/feasibility/floor_columns.h"
#include "core/planning/patches/collect_deficient.h"
#include "core/planning/patches/patches.h"
#include "core/planning/scoring/patch_tree.h"
#include "core/registration/bound/rival_forecast.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {
namespace {

// Bytes. `planning_estimate_test` compares their sum with what plans take.

// Per voxel of floor: candidate, piece, floor twice, whether the scanner fits, lines across gaps;
// and of these what is kept.
constexpr double kFindingFloor = 160;
constexpr double kFloor = 40;
// Per viewcell at an allowed height over a floor: why it is not feasible, and its index.
constexpr double kViewcell = 5;
// Per feasible view: its cell and position, estimates twice (interim plans), the map of scores.
constexpr double kView = 250;
// Per deficient cell of the patches: packed, with its share of bricks and of what cells have in
// common. Of measured surface, what each has alone.
constexpr double kCell = 13;
constexpr double kMeasuredCell = 36;
// Per deficient cell: its share of patches, of which a ninth is as large as a cell in scans that
// graze the floor.
constexpr double kPatchShare = sizeof(Patch) / 9.0;
// Per cell that stands for a cube, more: areas differ, so it has less in common with others, and a
// sixth are patches of their own, or, of cubes of whole bricks, two thirds.
constexpr double kCubeCell = 20 - kPatchShare;
constexpr double kCubePatch = sizeof(Patch) / 6.0;
constexpr double kBrickPatch = sizeof(Patch) * 0.7;
// Per deficient cell: the scorer's arrays (twelve numbers, the cell, where dropouts begin).
constexpr double kScorerCell = 13 * sizeof(float) + 0.5;
// Per deficient cell, while views are evaluated: the same cells by model gain (three of the
// numbers), places on the line that samples are drawn from, which were seen; and the largest of
// what comes one after another: samples (half of all cells), the tree (two nodes per packet) with
// the nodes that blocks of views list, a view's score and gain on each cell, on two threads.
constexpr double kEvaluatedCell =
    3 * sizeof(float) + 1 + 2 + 2.0 * sizeof(PatchTree::Node) / CellArrays::kPacket + 8;
// Per surface voxel: its share of the faces between it and what is empty, merged, a quarter of a
// face, with Embree's boxes.
constexpr double kFaces = 42;
// Per brick that holds both empty space and surface, where these are what rays meet: itself and
// half as many of unknown space beside empty, with Embree's boxes.
constexpr double kBricks = 200;
// Per surface voxel, while coverage is measured: what was asked of places around it. Where rays
// meet faces, their lists take more than that, and come before.
constexpr double kAskedOfVoxel = 8;
// Whatever the size.
constexpr double kAnyPlan = 4 << 20;

}  // namespace

PlanningSize::PlanningSize(const model::PlanningView& model, const PlanningConfig& config) {
  if (model.bounds().empty()) return;
  constexpr float kUp = 0.8F;  // cosine: floor is within 30 degrees of level, and beside walls
  double level = 0;
  double voxels_of_surface = 0;
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        ++voxels_of_surface;
        const bool measured = state == model::VoxelState::kTrueSurface;
        level += measured && surface.normal.z() > kUp ? 1 : 0;
        if (!Lacking(config, model, v, surface).has_value()) return;
        ++deficient_;
        measured_ += measured ? 1 : 0;
      });
  const auto voxels = static_cast<size_t>(deficient_);
  const int shift = CubeShift(voxels, config.max_cells);
  if (shift > 0) {
    const double left = CellsOfCubes(voxels, shift) / deficient_;
    deficient_ *= left;
    measured_ *= left;
    cubes_ = deficient_ * (kCubeCell + (shift == 3 ? kBrickPatch : kCubePatch));
  }
  const model::VoxelIndex size = model.bounds().max - model.bounds().min;
  const double columns = size.head<2>().cast<double>().prod();
  column_bytes_ = static_cast<double>(FloorColumns::Bytes(model.bounds()));
  // Floor is assumed in the blind cones of stations.
  constexpr double kBlindRadius = 2.6;  // m: 1.2 times the height of the tallest tripod
  const double blind = sensor::kPi * std::pow(kBlindRadius / model.voxel_size(), 2);
  floor_ = std::min(columns, level + blind * static_cast<double>(model.stations().size()));
  if (config.floor_z.has_value()) floor_ = columns;
  const double voxels_per_cell = std::max(1.0, config.viewcell_size / model.voxel_size());
  const double layers = (config.max_viewpoint_height - config.min_viewpoint_height) /
                            (voxels_per_cell * model.voxel_size()) +
                        1;
  viewcells_ = floor_ / (voxels_per_cell * voxels_per_cell) * layers;
  using visibility::OcclusionScene;
  const bool by_faces = OcclusionScene::PrimitivesOf(model) == visibility::ScenePrimitives::kFaces;
  scene_ = by_faces ? voxels_of_surface * kFaces
                    : voxels_of_surface * kAskedOfVoxel +
                          static_cast<double>(visibility::MixedBricks(model)) * kBricks;
  const model::VoxelBox box = visibility::OpaqueGrid(model).box();
  // Pose sensitivity and the hierarchy have a table each.
  tables_ = (config.pose_sensitivity ? 2.0 : 1.0) *
            static_cast<double>(visibility::SummedVolumeTable::Bytes(box.max - box.min));
  // Where twins are looked for.
  tables_ += registration::RivalForecast::EstimatedBytes(model);
}

void PlanningSize::Add(const PlanningSize& other) {
  column_bytes_ += other.column_bytes_;
  floor_ += other.floor_;
  viewcells_ += other.viewcells_;
  scene_ += other.scene_;
  deficient_ += other.deficient_;
  measured_ += other.measured_;
  cubes_ += other.cubes_;
  tables_ += other.tables_;
}

uint64_t PlanningSize::Bytes(double views) const {
  const double kept = column_bytes_ + floor_ * kFloor + viewcells_ * kViewcell;
  const double finding = floor_ * (kFindingFloor - kFloor);
  const double planning = views * kView +
                          deficient_ * (kCell + kPatchShare + kScorerCell + kEvaluatedCell) +
                          cubes_ + measured_ * kMeasuredCell + scene_ + tables_;
  return static_cast<uint64_t>(kAnyPlan + kept + std::max(finding, planning));
}

uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config) {
  const PlanningSize size(model, config);
  return size.Bytes(size.most_views());
}

absl::Status CheckPlanningSize(const PlanningSize& size, const PlanningConfig& config,
                               size_t views) {
  const uint64_t bytes = size.Bytes(static_cast<double>(views));
  if (bytes > config.memory_limit) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "planning: this model would take about %.2f GB of memory, more than the %.2f GB "
        "that a plan may take: use larger viewcells or voxels, split the site, or allow more "
        "(memory_limit)",
        static_cast<double>(bytes) / 1e9, static_cast<double>(config.memory_limit) / 1e9));
  }
  if (size.most_views() > static_cast<double>(std::numeric_limits<int32_t>::max())) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("planning: the model may have %.1e viewcells of %.3f m, more than can be "
                        "indexed: use larger ones, or split the site",
                        size.most_views(), config.viewcell_size));
  }
  return absl::OkStatus();
}

}  // namespace vantage::planning
