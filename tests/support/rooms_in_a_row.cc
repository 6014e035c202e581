#include "tests/support/rooms_in_a_row.h"

#include <cmath>

namespace vantage::test_support {

ClosedFormScene RoomsInARow(double first_door, double second_door) {
  using Eigen::Vector3d;
  ClosedFormScene scene;
  const double length = 3 * kRoomInARow + 2 * kWallInARow;
  scene.extent = Eigen::AlignedBox3d(Vector3d(-0.1, -0.1, -0.1), Vector3d(length + 0.1, 3.1, 2.6));
  scene.solid = [=](const Vector3d& p) {
    if (p.x() < 0 || p.x() > length || p.y() < 0 || p.y() > 3 || p.z() < 0 || p.z() > 2.5) {
      return true;
    }
    const auto wall = [&](double from, double door) {
      return p.x() > from && p.x() < from + kWallInARow &&
             (std::abs(p.y() - 1.5) > door / 2 || p.z() > 2);
    };
    return wall(kRoomInARow, first_door) || wall(2 * kRoomInARow + kWallInARow, second_door);
  };
  scene.density = [](const Vector3d& p) { return p.x() < kRoomInARow + 0.05 ? 5000 : 100; };
  scene.stations = {MakeStation(Vector3d(1.5, 1.5, 1.5))};
  return scene;
}

}  // namespace vantage::test_support
