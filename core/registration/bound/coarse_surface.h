// Where a model has true surface, coarsely and by the side that it faces, for squares of shifts at
// once: what no sample of a scan can lie on at any shift of a square takes one look-up to rule out
// (algorithm.md section 9, 'Prediction').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_COARSE_SURFACE_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_COARSE_SURFACE_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "core/model/view/planning_view.h"

namespace vantage::registration {

inline constexpr float kLevelSurface = 0.9f;  // cosine to the vertical, at least

// Immutable, so that threads may share it.
class CoarseSurface {
 public:
  // Squares of 1, 4 and 16 shifts a side.
  static constexpr int kLevels = 3;
  static constexpr int kWider = 4;
  static constexpr int Side(int level) { return level == 0 ? 1 : kWider * Side(level - 1); }

  // `step` (m): between shifts along x and along y. `reach` (m): from a sample to the centroid of a
  // voxel that it may lie on. Takes three bytes a cell of a step, 1.5 million at most: cells grow
  // with a site.
  CoarseSurface(const model::PlanningView& model, double step, double reach);

  // What one of a site of `size` (m) takes, bytes, and half as much again while it is made.
  static double Bytes(const Eigen::Vector3d& size, double step, double reach);

  double step() const { return step_; }
  // Whether there is level surface that faces upward, or downward, within `reach` of a height (m),
  // anywhere: half a square metre, as three treads have.
  bool HasLevel(double height, bool upward) const;
  // One bit, of the axis that a normal (unit, world) is nearest to.
  static uint8_t Facing(const Eigen::Vector3d& normal);
  // Whether a sample at `point` (m, world) that faces so may lie on surface at some shift of a
  // square: those of k and l steps along x and y, 0 <= k, l < Side(level). Never says no where
  // VoxelSearch::FindsAny() finds any, for normals in the horizontal plane or upright.
  bool MayLieOn(int level, const Eigen::Vector3d& point, uint8_t facing) const {
    const Eigen::Array3d cell = (point - origin_).array() * inverse_cell_;
    // Also false where it is not a number.
    if (!(cell >= 0).all() || !(cell < size_.cast<double>()).all()) return false;
    const Eigen::Array3i c = cell.cast<int>();
    return (levels_[static_cast<size_t>(level)][Flat(c)] & facing) != 0;
  }

 private:
  size_t Flat(const Eigen::Array3i& cell) const {
    return static_cast<size_t>(cell.x()) +
           static_cast<size_t>(size_.x()) *
               (static_cast<size_t>(cell.y()) +
                static_cast<size_t>(size_.y()) * static_cast<size_t>(cell.z()));
  }
  void Mark(const model::SurfaceVoxel& voxel, double reach);
  void Widen(int level);

  double step_;
  double reach_;
  double voxel_;
  std::array<std::map<int, double>, 2> level_area_;  // m^2, by voxel of height: downward, upward
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::Array3d inverse_cell_ = Eigen::Array3d::Ones();
  Eigen::Array3i size_ = Eigen::Array3i::Zero();
  std::array<std::vector<uint8_t>, kLevels> levels_;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_COARSE_SURFACE_H_
