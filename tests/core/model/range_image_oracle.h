// Judges a voxel directly from the range image, without pyramid, blocks or fast trigonometry. It
// shares no code with the model.
#ifndef VANTAGE_TESTS_CORE_MODEL_RANGE_IMAGE_ORACLE_H_
#define VANTAGE_TESTS_CORE_MODEL_RANGE_IMAGE_ORACLE_H_

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "core/model/view/voxel.h"
#include "core/sensor/scan.h"

namespace vantage::model {

// The rule. A direction reads the range of the four cells around it, linear in 1 / range both ways,
// where these are one surface; else that of the nearest cell; nothing more than half a step outside
// the grid. Neighbours are one surface when their ranges differ by at most five sigma, or when
// nearer range x angle between them >= difference x tan(discontinuity). A cell that is one surface
// with none of its neighbours and lies between a nearer and a farther one holds no sample; its ray
// is good up to the nearest of those beside it. So is a ray without range seven of whose eight
// neighbours have one. A voxel's centre and eight corners are read; a point is in front when the
// range there is farther than it.
//   - A voxel with a sample in it is surface.
//   - Else its centre decides: behind, it is not empty.
//   - In front, it is empty; or, when a corner lies behind by less than the voxel's diagonal, or
//   the
//     triangle of three neighbouring samples of one surface passes within half a diagonal of its
//     centre, crossed by the surface, and then surface as well as empty is right.
//   - Where nothing is known of the centre, 125 points spread over the voxel are read instead. None
//     known, or fewer than a quarter of the known in front: it is not empty. Three quarters known
//     and three quarters of those in front: it is empty. Between, it lies across the border of what
//     is known, and either is right.
class RangeImageOracle {
 public:
  enum class Verdict : uint8_t { kEmpty, kEmptyOrSurface, kNotEmpty, kAcrossTheBorder };

  RangeImageOracle(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                   double voxel_size, double discontinuity_angle);

  // How much farther than a point (m, model frame) the range in its direction is, m; NaN where
  // nothing is known.
  double Room(const Eigen::Vector3d& point) const;

  // Judges from Room() at a voxel's centre and corners.
  Verdict Of(const VoxelIndex& voxel, double centre, const std::array<double, 8>& corners) const;
  // True when the verdict depends on rounding: Room() at the centre changes its sign, or becomes
  // known or unknown, when the direction turns by 5e-6 rad or the distance changes by that share of
  // itself.
  bool IsTie(const VoxelIndex& voxel) const;
  // True when a triangle of three neighbouring samples of one surface passes within half a diagonal
  // of the voxel's centre. Of() does not check this and gives kEmpty.
  bool NearTriangle(const VoxelIndex& voxel) const;

 private:
  struct Place {
    int lower = 0;
    int upper = 0;
    double fraction = 0;
    bool inside = false;
  };
  size_t CellOf(int column, int row) const {
    return static_cast<size_t>(column) * elevation_.size() + static_cast<size_t>(row);
  }
  float At(int column, int row) const { return range_[CellOf(column, row)]; }
  Verdict ByManyPoints(const VoxelIndex& voxel) const;
  bool OneSurface(int column_a, int row_a, int column_b, int row_b) const;
  Place Column(double azimuth) const;
  Place Row(double elevation) const;
  double RangeAlong(double azimuth, double elevation) const;
  Eigen::Vector3d CentreOf(const VoxelIndex& voxel) const {
    return (voxel.cast<double>().array() + 0.5) * voxel_size_;
  }

  std::vector<double> azimuth_;
  std::vector<double> elevation_;
  bool full_turn_;
  std::vector<float> range_;
  Eigen::Isometry3d T_scan_model_;
  std::vector<Eigen::Vector3d> direction_;  // of each cell, scanner frame
  std::vector<float> passed_;               // m, how far the ray of a cell without range is good
  std::vector<uint8_t> joined_;             // 1: one surface with the next column, 2: next row
  double voxel_size_;
  double five_sigma_;  // of a difference of two ranges, m
  double tangent_;
  std::unordered_set<uint64_t> sampled_;  // voxels with a sample well inside them
};

}  // namespace vantage::model

#endif  // VANTAGE_TESTS_CORE_MODEL_RANGE_IMAGE_ORACLE_H_
