#include "core/model/carve/station.h"

#include <cmath>
#include <optional>

#include "core/model/carve/floor_below.h"
#include "core/model/carve/surface_points.h"

namespace vantage::model {

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
