#include "core/model/view/floor_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace vantage::model {
namespace {

// The page draws its plans by the same measures (client/web/src/model/floor_plan.ts).
// Over the floor, m: below it is floor, from it on something stands there.
constexpr double kFloorBand = 0.15;
// Where walls are told from furniture, over the floor, m: over tables and under lintels.
constexpr double kWallLow = 0.9;
constexpr double kWallHigh = 1.8;
// Of the voxels of that band, so many make a wall.
constexpr double kWallShare = 0.6;
// What a person walks under is no part of a plan, lintels and ceilings: all higher than this over
// the floor, m, is left out.
constexpr double kCeiling = 1.85;
// How far below its floor a storey begins, and so the one below it ends, m.
constexpr double kBelowFloor = 0.3;
// Missing surface over a cell is shown from this many times the cell's own area on: a voxel or two
// at the edge of something keeps no one busy.
constexpr double kMissingFrom = 1;
// A row with no more cells than this is a stray.
constexpr int kStray = 3;
constexpr int kTurns = 90;

// Missing area by SurfaceKind, m2.
using MissingArea = std::array<float, kSurfaceKinds>;

// The peak of a histogram over 90 degrees, rad, to a fraction of a degree by its neighbours.
double MainDirection(const std::array<double, kTurns>& turns) {
  const auto best = static_cast<int>(std::max_element(turns.begin(), turns.end()) - turns.begin());
  double sum = 0;
  double weight = 0;
  for (int off = -3; off <= 3; ++off) {
    const double w = turns[static_cast<size_t>((best + off + kTurns) % kTurns)];
    sum += w * off;
    weight += w;
  }
  const double degrees = best + 0.5 + (weight > 0 ? sum / weight : 0);
  return std::fmod(degrees + kTurns, kTurns) * std::numbers::pi / 180;
}

// Of every row, the first cell that shows something and the last; strays do not count.
std::vector<Eigen::Vector2d> ExtentOf(const FloorPlan& plan) {
  std::vector<Eigen::Vector2d> extent;
  for (int y = 0; y < plan.rows; ++y) {
    int first = plan.columns;
    int last = -1;
    int count = 0;
    for (int x = 0; x < plan.columns; ++x) {
      if (plan.cells[plan.At(x, y)] == PlanCell::kNothing) continue;
      first = std::min(first, x);
      last = x;
      ++count;
    }
    if (count <= kStray) continue;
    extent.push_back(plan.corner + plan.edge * Eigen::Vector2d(first, y));
    extent.push_back(plan.corner + plan.edge * Eigen::Vector2d(last + 1, y + 1));
  }
  return extent;
}

}  // namespace

FloorPlan DrawFloorPlan(const PlanningView& model, const StoreyBand& storey,
                        absl::FunctionRef<std::optional<double>(const Eigen::Vector3d&)> required,
                        size_t most_cells) {
  const double low = storey.floor - kBelowFloor;
  const double high = std::min(storey.top - kBelowFloor, storey.floor + kCeiling);
  Eigen::Vector2d min = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d max = -min;
  model.ForEachSurface([&](const VoxelIndex&, VoxelState, const SurfaceVoxel& surface) {
    const Eigen::Vector3d at = surface.centroid.cast<double>();
    if (at.z() < low || at.z() > high) return;
    min = min.cwiseMin(at.head<2>());
    max = max.cwiseMax(at.head<2>());
  });
  FloorPlan plan;
  plan.edge = model.voxel_size();
  if (!(min.x() <= max.x())) return plan;
  // Cells begin where voxels do, so that each column of voxels is one cell.
  const auto cells_along = [&](int axis) {
    return std::floor(max[axis] / plan.edge) - std::floor(min[axis] / plan.edge) + 1;
  };
  while (cells_along(0) * cells_along(1) > static_cast<double>(most_cells)) plan.edge *= 2;
  plan.corner = (min / plan.edge).array().floor() * plan.edge;
  plan.columns = static_cast<int>(cells_along(0));
  plan.rows = static_cast<int>(cells_along(1));
  const size_t count = static_cast<size_t>(plan.columns) * plan.rows;
  plan.cells.assign(count, PlanCell::kNothing);
  plan.missing.assign(count, std::nullopt);
  std::vector<uint8_t> upright(count, 0);
  std::vector<uint8_t> stands(count, 0);
  std::vector<MissingArea> missing(count, MissingArea{});
  std::array<double, kTurns> turns{};
  const auto add_one = [](uint8_t& counter) {
    if (counter < std::numeric_limits<uint8_t>::max()) ++counter;
  };

  model.ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& surface) {
    const Eigen::Vector3d place = surface.centroid.cast<double>();
    if (place.z() < low || place.z() > high) return;
    const Eigen::Vector2i column =
        ((place.head<2>() - plan.corner) / plan.edge).array().floor().cast<int>();
    const size_t at = plan.At(std::clamp(column.x(), 0, plan.columns - 1),
                              std::clamp(column.y(), 0, plan.rows - 1));
    const double over = place.z() - storey.floor;
    const std::optional<double> density = required(place);
    if (state != VoxelState::kTrueSurface) {
      if (!surface.given_up && density.has_value()) {
        missing[at][static_cast<size_t>(KindOf(state))] += surface.area;
      }
      return;
    }
    const bool thin = density.has_value() && surface.density < *density && !surface.given_up;
    if (over < kFloorBand) {
      if (surface.normal.z() > 0.7F) {
        plan.cells[at] = std::max(plan.cells[at], thin ? PlanCell::kThinFloor : PlanCell::kFloor);
      }
    } else {
      add_one(stands[at]);
      if (over >= kWallLow && over <= kWallHigh) add_one(upright[at]);
      if (thin) missing[at][static_cast<size_t>(SurfaceKind::kTrue)] += surface.area;
    }
    const Eigen::Vector3f& n = surface.normal;
    if (std::abs(n.z()) < 0.25F && n.head<2>().squaredNorm() > 0.6F) {
      const double degrees = std::atan2(n.y(), n.x()) * 180 / std::numbers::pi;
      const double turn = std::fmod(std::fmod(degrees, kTurns) + kTurns, kTurns);
      turns[std::min<size_t>(kTurns - 1, static_cast<size_t>(turn))] += surface.area;
    }
  });

  // Of each of the columns that stand side by side in a cell.
  const double columns = plan.edge / model.voxel_size();
  const double wall_voxels = columns * kWallShare * (kWallHigh - kWallLow) / model.voxel_size();
  for (size_t at = 0; at < count; ++at) {
    if (upright[at] >= wall_voxels) {
      plan.cells[at] = PlanCell::kWall;
    } else if (stands[at] >= 2) {
      plan.cells[at] = PlanCell::kFurniture;
    }
    auto most = static_cast<float>(kMissingFrom * plan.edge * plan.edge);
    for (size_t kind = 0; kind < missing[at].size(); ++kind) {
      if (missing[at][kind] <= most) continue;
      most = missing[at][kind];
      plan.missing[at] = static_cast<SurfaceKind>(kind);
    }
  }
  plan.direction = MainDirection(turns);
  plan.extent = ExtentOf(plan);
  return plan;
}

}  // namespace vantage::model
