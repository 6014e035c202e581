#include "core/registration/bound/coarse_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace vantage::registration {
namespace {

constexpr double kMostCoarseCells = 1.5e6;
// Shifts go across the floor, so that height needs to be told less well, steps.
constexpr double kHigher = 2;
// Cosine of a voxel's normal to an axis, from which it serves samples that are nearest to that
// axis: these are at most 45 degrees from it (in the horizontal plane), and normals of what a
// sample lies on at most 37 degrees from its own (VoxelSearch).
constexpr float kServesFacing = 0.13f;
constexpr double kLeastLevel = 0.5;  // m^2

}  // namespace

double CoarseSurface::Bytes(const Eigen::Vector3d& size, double step, double reach) {
  const double before = (Side(kLevels - 1) - 1) * step;
  const Eigen::Array3d box = size.array() + 2 * reach + Eigen::Array3d(before, before, 0);
  return 1.5 * kLevels *
         std::min(box.prod() / (kHigher * step * step * step), 2 * kMostCoarseCells);
}

CoarseSurface::CoarseSurface(const model::PlanningView& model, double step, double reach)
    : step_(step), reach_(reach), voxel_(model.voxel_size()) {
  Eigen::AlignedBox3d box;
  model.ForEachSurface(
      [&](const model::VoxelIndex& at, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface) return;
        box.extend(voxel.centroid.cast<double>());
        if (std::abs(voxel.normal.z()) < kLevelSurface) return;
        level_area_[voxel.normal.z() > 0 ? 1 : 0][at.z()] += static_cast<double>(voxel.area);
      });
  if (box.isEmpty()) return;
  const Eigen::Vector3d low = box.min() - Eigen::Vector3d::Constant(reach);
  const Eigen::Vector3d high = box.max() + Eigen::Vector3d::Constant(reach);
  const double cells = (high - low).cwiseMax(step).prod() / (kHigher * step * step * step);
  const double cell = step * std::max(1.0, std::cbrt(cells / kMostCoarseCells));
  // A square of shifts begins before what it ends on.
  constexpr int kBefore = Side(kLevels - 1) - 1;
  const Eigen::Vector3d cell_size(cell, cell, kHigher * cell);
  inverse_cell_ = cell_size.array().inverse();
  origin_ = low - Eigen::Vector3d(kBefore * cell, kBefore * cell, 0);
  size_ = ((high - origin_).array() * inverse_cell_).floor().cast<int>() + 1;
  for (std::vector<uint8_t>& level : levels_) level.assign(static_cast<size_t>(size_.prod()), 0);
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state == model::VoxelState::kTrueSurface) Mark(voxel, reach);
      });
  for (int level = 1; level < kLevels; ++level) Widen(level);
}

bool CoarseSurface::HasLevel(double height, bool upward) const {
  const std::map<int, double>& area = level_area_[upward ? 1 : 0];
  const auto bin = [&](double z) { return static_cast<int>(std::floor(z / voxel_)); };
  double found = 0;
  for (auto it = area.lower_bound(bin(height - reach_));
       it != area.end() && it->first <= bin(height + reach_); ++it) {
    found += it->second;
  }
  return found >= kLeastLevel;
}

uint8_t CoarseSurface::Facing(const Eigen::Vector3d& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<uint8_t>(1U << (2 * axis + (normal[axis] < 0 ? 1 : 0)));
}

void CoarseSurface::Mark(const model::SurfaceVoxel& voxel, double reach) {
  unsigned serves = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel.normal[axis] > kServesFacing) serves |= 1U << (2 * axis);
    if (voxel.normal[axis] < -kServesFacing) serves |= 1U << (2 * axis + 1);
  }
  const Eigen::Vector3d at = voxel.centroid.cast<double>() - origin_;
  const Eigen::Array3i first =
      ((at.array() - reach) * inverse_cell_).floor().cast<int>().max(0).min(size_ - 1);
  const Eigen::Array3i last =
      ((at.array() + reach) * inverse_cell_).floor().cast<int>().max(0).min(size_ - 1);
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        levels_[0][Flat({x, y, z})] |= static_cast<uint8_t>(serves);
      }
    }
  }
}

// Of each cell what it and those after it have, as many along x and y as shifts along a side: cells
// are no smaller than steps.
void CoarseSurface::Widen(int level) {
  const std::vector<uint8_t>& from = levels_[static_cast<size_t>(level) - 1];
  std::vector<uint8_t>& to = levels_[static_cast<size_t>(level)];
  std::vector<uint8_t> along_x(from.size());
  const int apart = Side(level - 1);
  const auto widen = [&](const std::vector<uint8_t>& of, std::vector<uint8_t>& into, int axis) {
    const size_t stride = axis == 0 ? 1 : static_cast<size_t>(size_.x());
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        for (int x = 0; x < size_.x(); ++x) {
          const int left = size_[axis] - 1 - (axis == 0 ? x : y);
          const size_t at = Flat({x, y, z});
          unsigned any = 0;
          for (int k = 0; k < kWider && k * apart <= left; ++k) {
            any |= of[at + static_cast<size_t>(k * apart) * stride];
          }
          into[at] = static_cast<uint8_t>(any);
        }
      }
    }
  };
  widen(from, along_x, 0);
  widen(along_x, to, 1);
}

}  // namespace vantage::registration
