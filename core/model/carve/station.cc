#include "core/model/carve/station.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/model/carve/surface_points.h"

namespace vantage::model {

namespace {

// A floor near the station: level, or rising on a slope.
struct FloorPlane {
  double height = 0;                               // m, at the station
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();  // m per m
  size_t columns = 0;                              // of voxels that lie on it

  // `aside`: m in plan from the station.
  double At(const Eigen::Vector2d& aside) const { return height + rise.dot(aside); }
};

// The lowest surface of a column of voxels.
struct Lowest {
  int z;
  double height;          // m, of the samples' centroid
  Eigen::Vector2d aside;  // m in plan, from the station
};

// On a slope a level is only where it cuts the ground, above or below the scanner's feet. A plane
// prevails over the level `floor` when so many times as many columns lie on it: in a room, however
// full, none does.
constexpr double kPrevails = 1.5;
constexpr double kSteepest = 0.58;  // m per m, 30 degrees: what floor is at most

FloorPlane OnASlope(const std::vector<Lowest>& columns, int level, double voxel_size,
                    const FloorPlane& floor) {
  constexpr int kRounds = 12;  // each takes in what lies on the plane through those before
  std::vector<const Lowest*> on;
  for (const Lowest& lowest : columns) {
    if (std::abs(lowest.z - level) <= 1) on.push_back(&lowest);
  }
  FloorPlane plane;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d heights = Eigen::Vector3d::Zero();
    for (const Lowest* lowest : on) {
      const Eigen::Vector3d at(1, lowest->aside.x(), lowest->aside.y());
      moments += at * at.transpose();
      heights += lowest->height * at;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(moments);
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-9)) return floor;
    const Eigen::Vector3d fit = solver.solve(heights);
    plane = {fit[0], fit.tail<2>(), 0};
    if (!(plane.rise.norm() <= kSteepest)) return floor;
    on.clear();
    for (const Lowest& lowest : columns) {
      // As far as what is in the same two or three layers of voxels.
      if (std::abs(lowest.height - plane.At(lowest.aside)) <= 1.5 * voxel_size) {
        on.push_back(&lowest);
      }
    }
    plane.columns = on.size();
  }
  return static_cast<double>(plane.columns) >= kPrevails * static_cast<double>(floor.columns)
             ? plane
             : floor;
}

// The floor is the level at which most columns of voxels around the scanner have their lowest
// surface. Walls and legs of tables end there too, so clutter does not outvote it. What lies deeper
// than a tripod is high is not the floor that it stands on, but one beyond an edge: from a plinth,
// a landing or the edge of a platform most of what a scanner sees is that. Its own floor may then
// lie in the blind cone altogether, and is not known.
std::optional<FloorPlane> FloorBelow(double voxel_size, const ScanLayer& layer) {
  constexpr double kRadius = 3.0;  // m, around the station: a room's, the next one may be a step up
  constexpr double kLeastDrop = 0.3;  // m, below the viewpoint: no tripod is lower
  constexpr double kMostDrop = 2.2;   // m: surveyors' tripods reach 1.9 m, and the scanner 0.3 more
  constexpr double kLeastFloor =
      0.05;  // m^2 of columns: more than a tripod's feet, or a stair's edge
  const Eigen::Vector3d viewpoint = layer.T_model_scan.translation();
  std::map<std::pair<int, int>, Lowest> columns;
  for (const auto& [key, brick] : layer.bricks.own()) {
    size_t rank = 0;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (!brick.surface.Has(local)) continue;
      const SurfaceSums sums = brick.sums[rank++];
      const VoxelIndex v = PlanningView::Global(BrickOf(key), local);
      const Eigen::Vector3d centre = (v.cast<double>().array() + 0.5) * voxel_size;
      if ((centre - viewpoint).head<2>().norm() > kRadius) continue;
      if (centre.z() > viewpoint.z() - kLeastDrop) continue;
      if (centre.z() < viewpoint.z() - kMostDrop - voxel_size) continue;
      const double mean = static_cast<double>(sums.point_sum[2]) / sums.points;
      const Lowest here{v.z(), (v.z() + mean / SurfaceSums::kUnits) * voxel_size,
                        (centre - viewpoint).head<2>()};
      const auto [it, fresh] = columns.try_emplace({v.x(), v.y()}, here);
      if (!fresh && here.z < it->second.z) it->second = here;
    }
  }
  const auto least_columns =
      std::max<int64_t>(1, std::lround(kLeastFloor / (voxel_size * voxel_size)));
  std::map<int, int> count;
  for (const auto& [column, lowest] : columns) ++count[lowest.z];
  const auto mode = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (mode == count.end() || mode->second < least_columns) return std::nullopt;
  double sum = 0;
  size_t votes = 0;
  std::vector<Lowest> all;
  for (const auto& [column, lowest] : columns) {
    all.push_back(lowest);
    // A floor on the border of two layers of voxels, and its noise, are in both.
    if (std::abs(lowest.z - mode->first) > 1) continue;
    sum += lowest.height;
    ++votes;
  }
  const FloorPlane level = {sum / static_cast<double>(votes), Eigen::Vector2d::Zero(), votes};
  return OnASlope(all, mode->first, voxel_size, level);
}

}  // namespace

void ClearStation(double voxel_size, ScanLayer& layer) {
  const Eigen::Vector3d viewpoint = layer.T_model_scan.translation();
  const std::optional<FloorPlane> floor = FloorBelow(voxel_size, layer);
  layer.station.position = viewpoint;
  layer.station.clearance = layer.scanner.clearance;
  layer.station.floor_found = floor.has_value();
  // Where no floor is visible, only the scanner's own height of clearance is sure to be free.
  layer.station.floor_height = floor ? floor->height : viewpoint.z() - layer.scanner.clearance;

  const double radius = layer.scanner.clearance;
  const int reach = static_cast<int>(std::ceil(radius / voxel_size)) + 1;
  const VoxelIndex foot =
      (Eigen::Vector3d(viewpoint.x(), viewpoint.y(), layer.station.floor_height) / voxel_size)
          .array()
          .floor()
          .cast<int>();
  const int top = static_cast<int>(std::floor((viewpoint.z() + radius) / voxel_size));
  SurfacePoints floor_points;
  for (int dx = -reach; dx <= reach; ++dx) {
    for (int dy = -reach; dy <= reach; ++dy) {
      VoxelIndex column = foot + VoxelIndex(dx, dy, 0);
      const Eigen::Vector2d centre = (column.head<2>().cast<double>().array() + 0.5) * voxel_size;
      if ((centre - viewpoint.head<2>()).norm() > radius + voxel_size) continue;
      const double height =
          floor ? floor->At(centre - viewpoint.head<2>()) : layer.station.floor_height;
      column.z() = static_cast<int>(std::floor(height / voxel_size));
      for (int z = column.z() + (floor ? 1 : 0); z <= top; ++z) {
        const VoxelIndex v(column.x(), column.y(), z);
        layer.bricks[KeyOf(Brick::Of(v))].empty.Set(Brick::LocalOf(v));
      }
      if (!floor) continue;
      const LayerBrick& brick = layer.bricks[KeyOf(Brick::Of(column))];
      if (brick.surface.Has(Brick::LocalOf(column))) continue;
      for (const double u : {0.25, 0.75}) {
        for (const double v : {0.25, 0.75}) {
          floor_points.AddInterpolated(
              {(column.x() + u) * voxel_size, (column.y() + v) * voxel_size, height}, voxel_size);
        }
      }
    }
  }
  floor_points.AddTo(layer);
}

}  // namespace vantage::model
