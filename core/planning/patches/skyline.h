// Where false surface lies under the open sky, and what is known to rise behind it (ours, not in
// the paper; algorithm.md section 5, 'What a sample is worth').
#ifndef VANTAGE_CORE_PLANNING_PATCHES_SKYLINE_H_
#define VANTAGE_CORE_PLANNING_PATCHES_SKYLINE_H_

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::planning {

// In each of sixteen directions in the horizontal, the sine of the elevation up to which something
// is to be expected there. All kAny: wherever one looks.
struct SkylineSines {
  static constexpr size_t kDirections = 16;
  static constexpr int8_t kAny = 127;  // else in 1/126

  std::array<int8_t, kDirections> sine;

  SkylineSines() { sine.fill(kAny); }
  bool covered() const { return sine[0] == kAny; }
  static size_t DirectionOf(double x, double y) {
    const double turn = std::atan2(y, x) / (2 * std::numbers::pi);  // [-0.5, 0.5]
    return static_cast<size_t>((turn + 1) * kDirections + 0.5) % kDirections;
  }
  static double AzimuthOf(size_t direction) {
    return 2 * std::numbers::pi * static_cast<double>(direction) / kDirections;
  }
  // True when a ray along (dx, dy, dz), of any length, passes over all of that.
  bool PassedBy(float dx, float dy, float dz) const {
    if (covered()) return false;
    const float range = std::sqrt(dx * dx + dy * dy + dz * dz);
    const auto expected =
        static_cast<float>(sine[DirectionOf(static_cast<double>(dx), static_cast<double>(dy))]);
    return dz * 126 > expected * range;
  }
};

class Skyline {
 public:
  // The model is kept: it outlives this. Nothing when cancelled on the way.
  static std::optional<Skyline> Of(const model::PlanningView& model,
                                   const parallel::Cancellation& cancelled = {});

  // True when the sky is seen from anywhere: the site, or some of it, lies outdoors.
  bool any_open() const { return any_open_; }
  // From a false surface voxel on, what was measured up to 30 m away; down by 45 degrees where
  // nothing was. Covered where the voxel is not under the open sky: walls and a ceiling are to be
  // expected behind it, wherever one looks.
  const SkylineSines& Around(const model::VoxelIndex& voxel);

  // True when the voxel is under the open sky, higher than any viewpoint, and nothing that was
  // measured behind it is as high: no view would see anything there. `normal`: unit, towards the
  // empty side.
  bool InSky(const model::VoxelIndex& voxel, const Eigen::Vector3f& normal);

 private:
  // A column of bricks.
  struct Column {
    int top = std::numeric_limits<int>::min();  // z of the highest measured voxel
    bool open = false;                          // the sky begins above what is known of it
  };

  explicit Skyline(const model::PlanningView& model) : model_(model) {}
  const Column* At(int x, int y) const {
    if (x < first_x_ || y < first_y_ || x >= first_x_ + size_x_ || y >= first_y_ + size_y_) {
      return nullptr;
    }
    return &columns_[static_cast<size_t>(x - first_x_) +
                     static_cast<size_t>(size_x_) * static_cast<size_t>(y - first_y_)];
  }
  SkylineSines LookAround(const model::VoxelIndex& brick, int z) const;

  const model::PlanningView& model_;
  double highest_view_ = -std::numeric_limits<double>::infinity();  // m
  bool any_open_ = false;
  int first_x_ = 0, first_y_ = 0, size_x_ = 0, size_y_ = 0;  // bricks
  std::vector<Column> columns_;
  // By column and z: the same for all voxels of a brick's layer.
  absl::flat_hash_map<uint64_t, SkylineSines> known_;
  SkylineSines covered_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_SKYLINE_H_
