#include "core/model/carve/voxel_visibility.h"

#include <algorithm>
#include <cmath>

#include "core/sensor/scanner_model.h"

namespace vantage::model {
namespace {

// Four lanes: what every x86-64 and arm64 has. The compiler turns the operators into instructions.
using Lanes = float __attribute__((vector_size(16)));

Lanes All(float value) { return Lanes{value, value, value, value}; }
Lanes Least(Lanes a, Lanes b) { return a < b ? a : b; }
Lanes Most(Lanes a, Lanes b) { return a < b ? b : a; }
Lanes Absolute(Lanes a) { return Most(a, -a); }

Lanes SquareRoot(Lanes a) {
  return Lanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

// The angle of (x, y) from the x axis, (-pi, pi], off by less than 4e-7: a library's arc tangent
// costs ten times as much. The polynomial is Abramowitz and Stegun's 4.4.49.
Lanes ArcTangent(Lanes y, Lanes x) {
  const Lanes across = Absolute(y);
  const Lanes along = Absolute(x);
  const Lanes t = Least(across, along) / Most(Most(across, along), All(1e-30f));
  const Lanes s = t * t;
  Lanes p = All(0.0028662257f);
  p = p * s - 0.0161657367f;
  p = p * s + 0.0429096138f;
  p = p * s - 0.0752896400f;
  p = p * s + 0.1065626393f;
  p = p * s - 0.1420889944f;
  p = p * s + 0.1999355085f;
  p = p * s - 0.3333314528f;
  p = (p * s + 1.0f) * t;
  constexpr auto kStraight = static_cast<float>(sensor::kPi);
  p = across > along ? kStraight / 2 - p : p;
  p = x < 0.0f ? kStraight - p : p;
  return y < 0.0f ? -p : p;
}

}  // namespace

VoxelVisibility::VoxelVisibility(const RangeSurface& surface, const Eigen::Isometry3d& T_model_scan,
                                 double voxel_size)
    : surface_(surface),
      voxel_size_(voxel_size),
      origin_(T_model_scan.translation()),
      R_scan_model_(T_model_scan.linear().transpose()) {}

VoxelVisibility::Block VoxelVisibility::Test(const VoxelIndex& corner) const {
  const Eigen::Vector3d first =
      R_scan_model_ * ((corner.cast<double>().array() + 0.5).matrix() * voxel_size_ - origin_);
  const Eigen::Matrix3d step = R_scan_model_ * voxel_size_;
  const auto along_row = [&](int axis) {
    const auto d = static_cast<float>(step(axis, 0));
    return Lanes{0, d, 2 * d, 3 * d};
  };
  const Lanes row_x = along_row(0);
  const Lanes row_y = along_row(1);
  const Lanes row_z = along_row(2);
  Block block;
  for (int row = 0; row < kSide * kSide; ++row) {
    const Eigen::Vector3f start =
        (first + step.col(1) * (row % kSide) + step.col(2) * (row / kSide)).cast<float>();
    const Lanes x = row_x + start.x();
    const Lanes y = row_y + start.y();
    const Lanes z = row_z + start.z();
    const Lanes level2 = x * x + y * y;
    const Lanes distance2 = level2 + z * z;
    const Lanes azimuth = ArcTangent(y, x);
    const Lanes elevation = ArcTangent(z, SquareRoot(level2));
    for (int k = 0; k < kSide; ++k) {
      const int bit = kSide * row + k;
      const float range = surface_.RangeAt(azimuth[k], elevation[k]).range;
      if (!(range > 0)) {
        block.untold |= uint64_t{1} << bit;
      } else if (distance2[k] < range * range) {
        block.empty |= uint64_t{1} << bit;
      }
    }
  }
  return block;
}

bool VoxelVisibility::MostRaysPass(const VoxelIndex& voxel) const {
  constexpr int kAcross = 5;  // rays each way: a twentieth of a metre in centimetres
  constexpr int kRays = kAcross * kAcross;
  constexpr int kLeastTelling = 7;  // of them, a quarter: fewer are the fringe of something else
  // Of the image, across the voxel: with fewer all rays ask the same cell.
  constexpr double kLeastCellsAcross = 1.5;
  const Eigen::Vector3d away =
      (voxel.cast<double>().array() + 0.5).matrix() * voxel_size_ - origin_;
  const double distance = away.norm();
  const double cells_across = voxel_size_ / (distance * surface_.elevation().widest_step());
  if (cells_across < kLeastCellsAcross || distance < voxel_size_) return false;
  const Eigen::Vector3d along = R_scan_model_ * away / distance;
  const Eigen::Vector3d aside = along.unitOrthogonal();
  const Eigen::Vector3f c = (along * distance).cast<float>();
  const Eigen::Vector3f u = (aside * voxel_size_).cast<float>();
  const Eigen::Vector3f v = (along.cross(aside) * voxel_size_).cast<float>();
  int telling = 0;
  int passing = 0;
  for (int ray = 0; ray < kRays; ray += 4) {
    Lanes i;
    Lanes j;
    for (int k = 0; k < 4; ++k) {
      const int row = (ray + k) / kAcross;
      const int column = (ray + k) % kAcross;
      i[k] = (static_cast<float>(row) + 0.5f) / kAcross - 0.5f;
      j[k] = (static_cast<float>(column) + 0.5f) / kAcross - 0.5f;
    }
    const Lanes x = c.x() + u.x() * i + v.x() * j;
    const Lanes y = c.y() + u.y() * i + v.y() * j;
    const Lanes z = c.z() + u.z() * i + v.z() * j;
    const Lanes azimuth = ArcTangent(y, x);
    const Lanes elevation = ArcTangent(z, SquareRoot(x * x + y * y));
    for (int k = 0; k < std::min(4, kRays - ray); ++k) {
      const float range = surface_.RangeAt(azimuth[k], elevation[k]).range;
      telling += range > 0 ? 1 : 0;
      passing += range > static_cast<float>(distance) ? 1 : 0;
    }
  }
  return telling >= kLeastTelling && 2 * passing > telling;
}

}  // namespace vantage::model
