// What the model says of one voxel (algorithm.md section 4).
#ifndef VANTAGE_CORE_MODEL_VIEW_VOXEL_H_
#define VANTAGE_CORE_MODEL_VIEW_VOXEL_H_

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/model/view/surface_voxels.h"

namespace vantage::model {

// Integer voxel coordinates: the voxel covers [index * h, (index + 1) * h) on each axis of the
// model frame, h being the voxel size.
using VoxelIndex = Eigen::Vector3i;

enum class VoxelState : uint8_t {
  kUnknown = 0,
  kEmpty = 1,           // seen through
  kTrueSurface = 2,     // measured
  kAbsorbed = 3,        // surface fused into a neighbour: opaque, without area, closes leaks
  kFalseOcclusion = 4,  // unknown next to empty, behind a measured surface
  kFalseHole = 5,       // unknown next to empty, along a ray with no return
  kFalseImage = 6,      // unknown next to empty, outside the field of view
};
inline constexpr int kVoxelStates = 7;

constexpr bool IsFalseSurface(VoxelState s) { return s >= VoxelState::kFalseOcclusion; }
constexpr bool HasArea(VoxelState s) { return s == VoxelState::kTrueSurface || IsFalseSurface(s); }

// The four kinds of surface that the metric weighs apart, in this order everywhere.
enum class SurfaceKind : uint8_t { kTrue = 0, kOcclusion = 1, kHole = 2, kImage = 3 };
inline constexpr int kSurfaceKinds = 4;
inline constexpr std::array<const char*, kSurfaceKinds> kSurfaceKindNames = {
    "true surface", "occlusion", "hole boundary", "image boundary"};
// Only for states that have area.
constexpr SurfaceKind KindOf(VoxelState s) {
  return s == VoxelState::kTrueSurface
             ? SurfaceKind::kTrue
             : static_cast<SurfaceKind>(static_cast<int>(s) -
                                        static_cast<int>(VoxelState::kFalseOcclusion) + 1);
}

// A scan's rays to a voxel that has area should have met it and did not come back, because of glass
// in between, for instance. Rays from there, or from farther away in the same direction, will drop
// out, too.
struct Dropout {
  Eigen::Vector3f from;  // m, model frame, where the scanner stood
  uint32_t local = 0;    // which voxel of the brick

  bool operator==(const Dropout&) const = default;
};

// A cube of voxels, the unit of storage, sharing and change. Immutable once published.
struct Brick {
  static constexpr int kSide = 8;
  static constexpr int kVoxels = kSide * kSide * kSide;

  // x fastest: local = x + 8 (y + 8 z).
  static constexpr int Local(int x, int y, int z) { return x + kSide * (y + kSide * z); }
  static int LocalOf(const VoxelIndex& v) { return Local(v.x() & 7, v.y() & 7, v.z() & 7); }
  // The brick that a voxel is in (floor division).
  static VoxelIndex Of(const VoxelIndex& v) { return {v.x() >> 3, v.y() >> 3, v.z() >> 3}; }

  std::array<VoxelState, kVoxels> state{};
  std::array<uint64_t, kSide> surface_mask{};  // bit local % 64 of word local / 64: has area
  SurfaceVoxels surface;                       // of the voxels in the mask, in order of local
  std::vector<Dropout> dropouts;               // of some of them, in order of local

  // The attributes of a voxel that has area, else nothing.
  std::optional<SurfaceVoxel> Surface(int local) const {
    const uint64_t bit = uint64_t{1} << (local % 64);
    if ((surface_mask[local / 64] & bit) == 0) return std::nullopt;
    int rank = std::popcount(surface_mask[local / 64] & (bit - 1));
    for (int word = 0; word < local / 64; ++word) rank += std::popcount(surface_mask[word]);
    return surface[static_cast<size_t>(rank)];
  }
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_VOXEL_H_
