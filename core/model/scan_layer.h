// What one scan at one pose says of space, voxel by voxel: the unit that merging adds and
// withdrawing takes away.
#ifndef VANTAGE_CORE_MODEL_SCAN_LAYER_H_
#define VANTAGE_CORE_MODEL_SCAN_LAYER_H_

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/planning_view.h"
#include "core/model/range_surface.h"
#include "core/model/reflections.h"
#include "core/model/voxel.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

// A set of voxels of one brick: bit local % 64 of word local / 64, one word a z-slice.
struct BrickMask {
  std::array<uint64_t, Brick::kSide> word{};

  bool Has(int local) const { return (word[local / 64] >> (local % 64) & 1) != 0; }
  void Set(int local) { word[local / 64] |= uint64_t{1} << (local % 64); }
  bool Any() const {
    uint64_t all = 0;
    for (const uint64_t w : word) all |= w;
    return all != 0;
  }
  int Count() const {
    int count = 0;
    for (const uint64_t w : word) count += std::popcount(w);
    return count;
  }
  // Calls fn(local) for each voxel of the set, in order.
  template <typename Fn>
  void ForEach(Fn&& fn) const {
    for (int w = 0; w < Brick::kSide; ++w) {
      for (uint64_t left = word[w]; left != 0; left &= left - 1) {
        fn(64 * w + std::countr_zero(left));
      }
    }
  }
  // How many voxels of the set come before `local`.
  int Rank(int local) const {
    int rank = std::popcount(word[local / 64] & ((uint64_t{1} << (local % 64)) - 1));
    for (int w = 0; w < local / 64; ++w) rank += std::popcount(word[w]);
    return rank;
  }
  bool operator==(const BrickMask&) const = default;
};

// Sums over the surface points in a voxel, in integers so that the order of adding never shows.
// Positions are offsets from the voxel's lowest corner in 1/1024 of its size.
struct SurfaceSums {
  static constexpr int kUnits = 1024;

  uint32_t samples = 0;  // measured points
  uint32_t points = 0;   // measured and interpolated ones
  std::array<uint64_t, 3> sample_sum{};
  std::array<uint64_t, 3> point_sum{};
  std::array<uint64_t, 6> product_sum{};  // of points: xx, xy, xz, yy, yz, zz

  void Add(const std::array<uint32_t, 3>& offset, bool measured) {
    ++points;
    for (size_t i = 0; i < 3; ++i) point_sum[i] += offset[i];
    if (measured) {
      ++samples;
      for (size_t i = 0; i < 3; ++i) sample_sum[i] += offset[i];
    }
    size_t k = 0;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = i; j < 3; ++j) product_sum[k++] += uint64_t{offset[i]} * offset[j];
    }
  }
  void Add(const SurfaceSums& other) {
    samples += other.samples;
    points += other.points;
    for (size_t i = 0; i < 3; ++i) sample_sum[i] += other.sample_sum[i];
    for (size_t i = 0; i < 3; ++i) point_sum[i] += other.point_sum[i];
    for (size_t i = 0; i < 6; ++i) product_sum[i] += other.product_sum[i];
  }
};

struct LayerBrick {
  BrickMask empty;
  BrickMask surface;
  std::vector<SurfaceSums> sums;  // of the voxels in `surface`, in order of local
};

using BrickKey = uint64_t;
// Brick coordinates of at most 21 bits each, packed so that they sort by z, y, x.
inline BrickKey KeyOf(const VoxelIndex& brick) {
  constexpr int64_t kBias = 1 << 20;
  return static_cast<uint64_t>(brick.z() + kBias) << 42 |
         static_cast<uint64_t>(brick.y() + kBias) << 21 | static_cast<uint64_t>(brick.x() + kBias);
}
inline VoxelIndex BrickOf(BrickKey key) {
  constexpr int64_t kBias = 1 << 20;
  constexpr uint64_t kMask = (1 << 21) - 1;
  return {static_cast<int>(static_cast<int64_t>(key & kMask) - kBias),
          static_cast<int>(static_cast<int64_t>(key >> 21 & kMask) - kBias),
          static_cast<int>(static_cast<int64_t>(key >> 42) - kBias)};
}

struct ScanLayer {
  RangeSurface range_surface;
  ScannerModel scanner;        // with the scan's native steps
  double elevation_first = 0;  // rad, half a step below the lowest row
  double elevation_last = 0;   // rad, half a step above the highest
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  Stand stand{};
  std::vector<Reflector> reflectors{};  // that the scan itself shows, scanner's frame
  absl::flat_hash_map<BrickKey, LayerBrick> bricks{};  // that hold anything but unknown
  // What all scans show to reflect (model frame), and the bricks as they were before what the scan
  // saw in it was taken out (phantoms.h).
  std::vector<Aperture> apertures{};
  absl::flat_hash_map<BrickKey, LayerBrick> set_aside{};
  size_t samples = 0;
  size_t empty_voxels = 0;
  size_t surface_voxels = 0;

  const LayerBrick* Find(const VoxelIndex& brick) const {
    const auto it = bricks.find(KeyOf(brick));
    return it == bricks.end() ? nullptr : &it->second;
  }
  bool Empty(const VoxelIndex& voxel) const {
    const LayerBrick* brick = Find(Brick::Of(voxel));
    return brick != nullptr && brick->empty.Has(Brick::LocalOf(voxel));
  }
  // Why the scan leaves a point (m, model frame) unknown, if it does.
  UnknownReason ReasonAt(const Eigen::Vector3d& point) const;

  // Did the scan's ray through a surface element (m, model frame; unit normal) not come back, with
  // nothing in between and within range? A ray that ended at a reflector may have done so up to a
  // voxel behind it.
  enum class Miss : uint8_t {
    kNone,
    kAskew,  // beyond the maximum incidence, from either side: not to be measured from there
    kSquare  // by all that is known it should have been measured
  };
  Miss MissAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double voxel_size) const;

  // The recorded sampling density of the scan on a surface element (m, model frame; unit normal):
  // the smallest over a voxel-sized square around the point. 0 beyond the maximum incidence and
  // outside the field of view.
  double DensityAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                   double voxel_size) const;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_SCAN_LAYER_H_
