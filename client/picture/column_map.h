// The model's surfaces seen from above: each cell is a column of voxels, with the surface in it.
#ifndef VANTAGE_CLIENT_PICTURE_COLUMN_MAP_H_
#define VANTAGE_CLIENT_PICTURE_COLUMN_MAP_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "core/model/view/voxel.h"

namespace vantage::picture {

// A surface voxel as the export gives it.
struct SurfaceElement {
  Eigen::Vector3d position;  // m, world
  Eigen::Vector3f normal;    // unit
  model::SurfaceKind kind = model::SurfaceKind::kTrue;
  float area = 0;     // m^2
  float density = 0;  // samples / m^2
};

// The class that a column is shown as, the most important first.
enum class ColumnClass : uint8_t {
  kNothing,           // no surface here
  kMeasuredFlat,      // floor, ceiling, table tops at the required density
  kUnderSampledFlat,  // the same, most of it below the required density
  kMeasured,          // walls and furniture sides at the required density
  kUnderSampled,
  kOcclusion,
  kHole,
  kImage,
};

struct Column {
  ColumnClass shown = ColumnClass::kNothing;
  float strength = 0;  // [0, 1]: how much of a wall's height stands behind the class
  std::array<float, model::kSurfaceKinds> area{};  // m^2 by kind
};

class ColumnMap {
 public:
  // `cell` in m, the voxel size. Surfaces far from nearly everything (rays that left through an
  // open door) are cut off: the map covers `share` of the area on each axis.
  ColumnMap(std::span<const SurfaceElement> surfaces, double cell, double required_density,
            double share = 0.998);

  double cell() const { return cell_; }
  int width() const { return size_.x(); }
  int height() const { return size_.y(); }
  // m, model frame, the map's lower corner.
  Eigen::Vector2d origin() const { return first_.cast<double>() * cell_; }
  const Column& At(int x, int y) const { return columns_[static_cast<size_t>(y) * size_.x() + x]; }
  Eigen::AlignedBox2d bounds() const {
    return {origin(), Eigen::Vector2d((first_ + size_).cast<double>() * cell_)};
  }

 private:
  double cell_;
  Eigen::Vector2i first_ = Eigen::Vector2i::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Column> columns_;
};

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_COLUMN_MAP_H_
