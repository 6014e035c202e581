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
#include "core/model/carve/layer_bricks.h"
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

struct ScanLayer {
  RangeSurface range_surface;
  sensor::ScannerModel scanner;  // with the scan's native steps
  double elevation_first = 0;    // rad, half a step below the lowest row
  double elevation_last = 0;     // rad, half a step above the highest
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  Station station{};
  std::vector<Reflector> reflectors{};         // that the scan itself shows, scanner's frame
  std::vector<SuspectedReflector> suspects{};  // that other scans may tell
  HoleMap holes{};                             // of the range surface
  LayerBricks bricks{};                        // that hold anything but unknown
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

  size_t Bytes() const;  // of memory, about

  const LayerBrick* Find(const VoxelIndex& brick) const { return bricks.Find(KeyOf(brick)); }
  bool Empty(const VoxelIndex& voxel) const {
    const LayerBrick* brick = Find(Brick::Of(voxel));
    return brick != nullptr && brick->empty.Has(Brick::LocalOf(voxel));
  }
  bool WithinSite(const Eigen::Vector3d& point) const {
    return (point.array().abs() <= site.array()).all();
  }
  // Why the scan leaves a point (m, model frame) unknown, if it does.
  UnknownReason ReasonAt(const Eigen::Vector3d& point) const;

  // True when the scan says that there is nothing to look for at a point (m, model frame) within
  // the site: its ray there went into the open sky, and would have seen something up to there
  // (SkyRange), give or take what two voxels measure. What lies farther the scan cannot tell.
  bool InSky(const Eigen::Vector3d& point, double voxel_size) const;

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
