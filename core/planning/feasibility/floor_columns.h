// Floors by column of voxels, any number over one another (algorithm.md section 7A, 'The floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_COLUMNS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_COLUMNS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"

namespace vantage::planning {

// How the height of a floor is known.
enum class FloorSource : uint8_t {
  kMeasured,  // by samples on it
  kStation,   // a scanner has stood on it
  kBetween,   // it lies between measured floor and was not measured itself
  kHidden,    // a step under a tripod: up to half a step higher or lower (HiddenSteps())
  kGiven,     // a person said so
  kExpected,  // it is not known: a room behind a doorway has one (algorithm.md section 7E)
};

struct Floor {
  float height = 0;  // m, z
  FloorSource source = FloorSource::kMeasured;

  bool measured() const {
    return source == FloorSource::kMeasured || source == FloorSource::kStation;
  }
};

// A floor and the column that it lies in.
struct PlacedFloor {
  uint32_t column = 0;
  Floor floor;
};

// One of each that several lines placed in a column: those at most `apart` (m) over the lowest of
// them, at their mean, with its source. By column, from the lowest up.
std::vector<PlacedFloor> MeanOfLines(std::vector<PlacedFloor> placed, double apart);

// The floors in each column of voxels of a rectangle, from the lowest up.
class FloorColumns {
 public:
  FloorColumns() = default;  // of no columns
  // The columns of the box, without floors.
  explicit FloorColumns(const model::VoxelBox& box);

  // What the columns of the box take while floors are found in them: where the floors of each
  // begin, three times. They are dense, since most of a site's box has a floor.
  static uint64_t Bytes(const model::VoxelBox& box) {
    if (box.empty()) return 0;
    const Eigen::Vector2d size = (box.max - box.min).head<2>().cast<double>();
    return static_cast<uint64_t>(3 * sizeof(uint32_t) * size.prod());
  }

  // Replaces all floors. The order does not matter.
  void Assign(std::span<const PlacedFloor> placed);
  // What Assign() would have to be given.
  std::vector<PlacedFloor> Placed() const;

  size_t columns() const { return begin_.empty() ? 0 : begin_.size() - 1; }
  const Eigen::Vector2i& size() const { return size_; }
  bool Inside(int x, int y) const {
    return x >= min_.x() && y >= min_.y() && x < min_.x() + size_.x() && y < min_.y() + size_.y();
  }
  // Only for columns inside.
  uint32_t ColumnOf(int x, int y) const {
    return static_cast<uint32_t>(x - min_.x()) +
           static_cast<uint32_t>(size_.x()) * static_cast<uint32_t>(y - min_.y());
  }
  // The indices x and y of a column's voxels.
  Eigen::Vector2i Voxel(uint32_t column) const {
    return min_ + Eigen::Vector2i(static_cast<int>(column) % size_.x(),
                                  static_cast<int>(column) / size_.x());
  }
  std::span<const Floor> floors() const { return floors_; }
  std::span<const Floor> In(uint32_t column) const {
    return std::span<const Floor>(floors_).subspan(begin_[column],
                                                   begin_[column + 1] - begin_[column]);
  }
  // Empty outside.
  std::span<const Floor> At(int x, int y) const {
    return Inside(x, y) ? In(ColumnOf(x, y)) : std::span<const Floor>();
  }
  // The floor in the column of voxels (x, y) that is nearest in height, and at most `most` (m)
  // higher or lower; null when there is none.
  const Floor* Near(int x, int y, float height, double most) const;
  // The highest floor at or below z (m); when all are higher the lowest, null when there is none.
  const Floor* Below(int x, int y, double z) const;

 private:
  Eigen::Vector2i min_ = Eigen::Vector2i::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<uint32_t> begin_;  // of each column its first floor; one more at the end
  std::vector<Floor> floors_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_COLUMNS_H_
