// What one scan at one pose says of space, voxel by voxel: the unit that merging adds and
// withdrawing takes away.
#ifndef VANTAGE_CORE_MODEL_CARVE_SCAN_LAYER_H_
#define VANTAGE_CORE_MODEL_CARVE_SCAN_LAYER_H_

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/carve/cut_returns.h"
#include "core/model/reflections/reflections.h"
#include "core/model/scan/hole_map.h"
#include "core/model/scan/range_surface.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/planning_view.h"
#include "core/model/view/voxel.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

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

struct ScanLayer {
  RangeSurface range_surface;
  sensor::ScannerModel scanner;  // with the scan's native steps
  double elevation_first = 0;    // rad, half a step below the lowest row
  double elevation_last = 0;     // rad, half a step above the highest
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  Station station{};
  std::vector<Reflector> reflectors{};  // that the scan itself shows, scanner's frame
  HoleMap holes{};                      // of the range surface
  absl::flat_hash_map<BrickKey, LayerBrick> bricks{};  // that hold anything but unknown
  // The apertures that all scans together show (model frame), and the bricks as they were before
  // what this scan saw through them was taken out (core/model/merge/reflection_mask.h).
  std::vector<Aperture> apertures{};
  absl::flat_hash_map<BrickKey, LayerBrick> set_aside{};
  size_t samples = 0;
  size_t empty_voxels = 0;
  size_t surface_voxels = 0;
  // ModelConfig::max_half_extent, m: outside nothing is looked for.
  Eigen::Vector3d site = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  CutReturns cut{};                                     // snapshots do not keep it: 0 then
  size_t sky_rays = 0;                                  // the same
  uint32_t algorithm_version = kModelAlgorithmVersion;  // that it was carved with

  const LayerBrick* Find(const VoxelIndex& brick) const {
    const auto it = bricks.find(KeyOf(brick));
    return it == bricks.end() ? nullptr : &it->second;
  }
  bool Empty(const VoxelIndex& voxel) const {
    const LayerBrick* brick = Find(Brick::Of(voxel));
    return brick != nullptr && brick->empty.Has(Brick::LocalOf(voxel));
  }
  bool WithinSite(const Eigen::Vector3d& point) const {
    return (point.array().abs() <= site.array()).all();
  }
  // Why the scan leaves a point (m, model frame) unknown, if it does.
  UnknownReason ReasonAt(const Eigen::Vector3d& point) const;

  // Whether the scan missed a surface element (m, model frame; unit normal): the element was within
  // range, nothing stood in between, and the ray through it did not come back. A ray that ended at
  // a reflector may have ended up to a voxel behind the element.
  enum class Miss : uint8_t {
    kNone,
    kAskew,  // beyond the maximum incidence, from either side: not to be measured from there
    kSquare  // by all that is known it should have been measured
  };
  Miss MissAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double voxel_size) const;

  // The sampling density of the scan on a surface element (m, model frame; unit normal), samples /
  // m^2. 0 beyond the maximum incidence and outside the field of view.
  struct Density {
    double recorded = 0;  // the smallest over a voxel-sized square around the point
    double at_point = 0;
  };
  // Where the recorded density is at most `best`, a larger one, of at most `best`, may be returned.
  Density DensityAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double voxel_size,
                    double best = 0) const;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_SCAN_LAYER_H_
