// A limit on the memory that carving takes, counted while it is taken.
#ifndef VANTAGE_CORE_MODEL_CARVE_CARVE_ROOM_H_
#define VANTAGE_CORE_MODEL_CARVE_CARVE_ROOM_H_

#include <atomic>
#include <cstdint>
#include <limits>

namespace vantage::model {

// Thread safe. Each part of a layer counts with the memory that it will have taken when it is
// merged, so a scan that stays within the limit while it is carved does so while it is merged, too.
class CarveRoom {
 public:
  static constexpr int64_t kUnlimited = std::numeric_limits<int64_t>::max();

  explicit CarveRoom(int64_t bytes) : bytes_(bytes) {}

  // False when that is more than there is: carving ends then, at the next boundary of its loops.
  bool Take(int64_t bytes) {
    return taken_.fetch_add(bytes, std::memory_order_relaxed) + bytes <= bytes_;
  }
  bool spent() const { return taken_.load(std::memory_order_relaxed) > bytes_; }

 private:
  const int64_t bytes_;
  std::atomic<int64_t> taken_{0};
};

// Bytes at the peak of inserting, of what is cut into parts as small as these; measured by
// insert_estimate_test.
//
// Of a cell of the range image: its surface, while it is made; and of a cell that stays in the
// layer (ThinLayer). All cells are there while voxels are carved, which take less then than when
// they are merged.
inline constexpr double kBytesOfCell = 15.5;
inline constexpr double kBytesOfCellKept = 5.1;
// Of a voxel with surface: sums in the layer, planes while it is merged, attributes.
inline constexpr double kBytesOfSurface = 213;
inline constexpr double kBytesOfSurfaceKept = 105;
// Of a voxel where what was seen empty ends: its share of a brick.
inline constexpr double kBytesOfBoundary = 19.5;
// Of a page (8 x 8 x 8 bricks) that anything is known of.
inline constexpr double kBytesOfPage = 1700;

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_CARVE_ROOM_H_
