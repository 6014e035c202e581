// One brick while it is merged: what the scans add up to, and what follows from it.
#ifndef VANTAGE_CORE_MODEL_MERGE_MERGED_BRICK_H_
#define VANTAGE_CORE_MODEL_MERGE_MERGED_BRICK_H_

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/view/brick_mask.h"

namespace vantage::model {

// The union of the scans' layers in one brick. Reads the layers: they stay as they are meanwhile.
struct UnitedBrick {
  UnitedBrick(const BrickMask& empty_voxels, const BrickMask& surface_voxels)
      : empty(empty_voxels), surface(surface_voxels) {
    for (size_t w = 1; w < before.size(); ++w) {
      before[w] = static_cast<uint16_t>(before[w - 1] + std::popcount(surface.word[w - 1]));
    }
  }
  UnitedBrick(const UnitedBrick&) = delete;
  UnitedBrick& operator=(const UnitedBrick&) = delete;

  // Which of the surface voxels `local` is.
  size_t Rank(int local) const {
    const auto w = static_cast<size_t>(local / 64);
    const uint64_t below = (uint64_t{1} << (local % 64)) - 1;
    return before[w] + static_cast<size_t>(std::popcount(surface.word[w] & below));
  }

  const BrickMask empty;    // seen empty by a scan, surface to none
  const BrickMask surface;  // surface to a scan, and not seen through by several
  std::array<uint16_t, Brick::kSide> before{};  // surface voxels in the slices below each
  // Of the voxels in `surface`, in order of local: `added`, or those of the only layer that has
  // any.
  PackedSums::View sums;
  PackedSums added;
};

// The plane through a surface voxel's neighbourhood.
struct LocalPlane {
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero();  // m, of the voxel's own points
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    // unit, towards the scanners
  float flatness = 0;   // m, rms distance of the neighbourhood's points from the plane
  uint32_t weight = 0;  // points in the voxel, measured ones first
};

// Parts of the same index belong to the same surface voxel.
struct MergedBrick {
  std::shared_ptr<const UnitedBrick> united;
  std::vector<LocalPlane> fitted;  // by the neighbourhood alone
  std::vector<LocalPlane> plane;   // at edges, that of the best neighbouring plane
  std::vector<uint8_t> dominated;  // a neighbour with more support holds the same surface
  std::vector<int8_t> absorbed;    // -1, or into which of the 125 voxels around
  BrickMask given_away;            // the voxels that are absorbed: few
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_MERGED_BRICK_H_
