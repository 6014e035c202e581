#include "core/model/carve/station.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "core/model/carve/surface_points.h"

namespace vantage::model {

namespace {

// The floor is the level at which most columns of voxels around the scanner have their lowest
// surface. Walls and legs of tables end there too, so clutter does not outvote it. What lies deeper
// than a tripod is high is not the floor that it stands on, but one beyond an edge: from a plinth,
// a landing or the edge of a platform most of what a scanner sees is that. Its own floor may then
// lie in the blind cone altogether, and is not known.
std::optional<double> FloorBelow(double voxel_size, const ScanLayer& layer) {
  constexpr double kRadius = 3.0;  // m, around the station: a room's, the next one may be a step up
  constexpr double kLeastDrop = 0.3;  // m, below the viewpoint: no tripod is lower
  constexpr double kMostDrop = 2.2;   // m: surveyors' tripods reach 1.9 m, and the scanner 0.3 more
  constexpr double kLeastFloor =
      0.05;  // m^2 of columns: more than a tripod's feet, or a stair's edge
  const Eigen::Vector3d viewpoint = layer.T_model_scan.translation();
  struct Lowest {
    int z;
    double height;  // of the samples' centroid, m
  };
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
      const Lowest here{v.z(), (v.z() + mean / SurfaceSums::kUnits) * voxel_size};
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
  int votes = 0;
  for (const auto& [column, lowest] : columns) {
    // A floor on the border of two layers of voxels, and its noise, are in both.
    if (std::abs(lowest.z - mode->first) > 1) continue;
    sum += lowest.height;
    ++votes;
  }
  return sum / votes;
}

}  // namespace

void ClearStation(double voxel_size, ScanLayer& layer) {
  const Eigen::Vector3d viewpoint = layer.T_model_scan.translation();
  const std::optional<double> floor = FloorBelow(voxel_size, layer);
  layer.station.position = viewpoint;
  layer.station.clearance = layer.scanner.clearance;
  layer.station.floor_found = floor.has_value();
  // Where no floor is visible, only the scanner's own height of clearance is sure to be free.
  layer.station.floor_height = floor.value_or(viewpoint.z() - layer.scanner.clearance);

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
      const VoxelIndex column = foot + VoxelIndex(dx, dy, 0);
      const Eigen::Vector2d centre = (column.head<2>().cast<double>().array() + 0.5) * voxel_size;
      if ((centre - viewpoint.head<2>()).norm() > radius + voxel_size) continue;
      for (int z = foot.z() + (floor ? 1 : 0); z <= top; ++z) {
        const VoxelIndex v(column.x(), column.y(), z);
        layer.bricks[KeyOf(Brick::Of(v))].empty.Set(Brick::LocalOf(v));
      }
      if (!floor) continue;
      const LayerBrick& brick = layer.bricks[KeyOf(Brick::Of(column))];
      if (brick.surface.Has(Brick::LocalOf(column))) continue;
      for (const double u : {0.25, 0.75}) {
        for (const double v : {0.25, 0.75}) {
          floor_points.AddInterpolated(
              {(column.x() + u) * voxel_size, (column.y() + v) * voxel_size, *floor}, voxel_size);
        }
      }
    }
  }
  floor_points.AddTo(layer);
}

}  // namespace vantage::model
