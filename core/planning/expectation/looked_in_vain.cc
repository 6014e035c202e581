#include "core/planning/expectation/looked_in_vain.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "absl/status/status.h"
#include "core/planning/expectation/brick_edit.h"
#include "core/visibility/voxel_walk.h"

namespace vantage::planning {
namespace {

// How a station has to look at a place for its scan to show what is there, whatever the scanner: no
// flatter (cosine, 75 degrees), from no farther (m), and no more steeply down (sine), since tripods
// are blind there.
constexpr double kFlattestLook = 0.26;
constexpr double kFarthestLook = 10;
constexpr double kSteepestLook = 0.85;

// Whether the model knows space in a brick or beside it.
bool AnySeenAround(const model::PlanningView& model, const model::VoxelIndex& brick) {
  constexpr int kHalf = model::Brick::kSide / 2;
  for (int z = -1; z <= 2; ++z) {
    for (int y = -1; y <= 2; ++y) {
      for (int x = -1; x <= 2; ++x) {
        if (model.Empty(brick * model::Brick::kSide + kHalf * model::VoxelIndex(x, y, z))) {
          return true;
        }
      }
    }
  }
  return false;
}

bool LooksAt(const model::PlanningView& expected, const sensor::ScannerModel& scanner,
             const model::Station& station, const model::VoxelIndex& v,
             const model::SurfaceVoxel& surface) {
  const Eigen::Vector3d at = surface.centroid.cast<double>();
  const Eigen::Vector3d way = station.position - at;
  const double range = way.norm();
  if (range > std::min(kFarthestLook, scanner.range_max)) return false;
  const double lowest = std::max(-kSteepestLook, std::sin(scanner.elevation_min));
  if (-way.z() < lowest * range || -way.z() > std::sin(scanner.elevation_max) * range) return false;
  if (surface.normal.cast<double>().dot(way) < kFlattestLook * range) return false;
  return visibility::WalkVoxels(at / expected.voxel_size(),
                                station.position / expected.voxel_size(),
                                [&](const model::VoxelIndex& on_way, double /*entry*/) {
                                  return on_way == v || expected.Empty(on_way);
                                });
}

}  // namespace

std::vector<model::BrickAt> SeenAround(const model::PlanningView& model,
                                       std::span<const model::BrickAt> bricks) {
  std::vector<model::BrickAt> seen;
  std::copy_if(bricks.begin(), bricks.end(), std::back_inserter(seen),
               [&](const model::BrickAt& at) { return AnySeenAround(model, at.brick); });
  return seen;
}

absl::StatusOr<std::vector<ExpectedSurface>> LookedAtInVain(
    const model::PlanningView& model, const model::PlanningView& expected,
    std::span<const model::BrickAt> changed, std::span<const model::Station> stations,
    const sensor::ScannerModel& scanner, const parallel::Cancellation& cancelled, size_t every) {
  std::vector<ExpectedSurface> found;
  size_t only = 0;
  if (!scanner.TurnsAllAround()) return found;
  for (const model::BrickAt& at : changed) {
    if (cancelled.Requested()) return absl::CancelledError("expectation");
    size_t rank = 0;
    for (size_t word = 0; word < at.contents->surface_mask.size(); ++word) {
      for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1) {
        const int local = static_cast<int>(word) * 64 + std::countr_zero(bits);
        const model::SurfaceVoxel& surface = at.contents->surface[rank++];
        const model::VoxelIndex v = model::PlanningView::Global(at.brick, local);
        const bool only_expected =
            NothingKnown(model.State(v)) && expected.State(v) == model::VoxelState::kTrueSurface;
        if (!only_expected || only++ % every != 0) continue;
        if (std::any_of(stations.begin(), stations.end(), [&](const model::Station& station) {
              return LooksAt(expected, scanner, station, v, surface);
            })) {
          found.push_back({v, surface});
        }
      }
    }
  }
  return found;
}

std::vector<model::Station> StationsBefore(const model::PlanningView& model,
                                           const Opening& doorway) {
  // Where somebody looks through: so far before the doorway's plane, where space is known (m),
  // across it (of its width), and over its floor (m).
  constexpr double kBefore = 0.1;
  constexpr std::array<double, 5> kAcross = {0, -0.2, 0.2, -0.4, 0.4};
  constexpr std::array<double, 3> kOver = {1.2, 0.6, 1.8};
  const Eigen::Vector3d across(-doorway.direction.y(), doorway.direction.x(), 0);
  std::vector<Eigen::Vector3d> points;
  for (const double over : kOver) {
    for (const double part : kAcross) {
      points.emplace_back(doorway.centre - kBefore * doorway.direction +
                          part * doorway.width * across + over * Eigen::Vector3d::UnitZ());
    }
  }
  const auto sees = [&](const model::Station& station, const Eigen::Vector3d& point) {
    return visibility::WalkVoxels(
        point / model.voxel_size(), station.position / model.voxel_size(),
        [&](const model::VoxelIndex& on_way, double /*entry*/) { return model.Empty(on_way); });
  };
  std::vector<model::Station> before;
  for (const model::Station& station : model.stations()) {
    const Eigen::Vector3d way = doorway.centre - station.position;
    if (way.head<2>().norm() > kFarthestLook || way.dot(doorway.direction) < kBefore) continue;
    if (std::any_of(points.begin(), points.end(),
                    [&](const Eigen::Vector3d& point) { return sees(station, point); })) {
      before.push_back(station);
    }
  }
  return before;
}

}  // namespace vantage::planning
