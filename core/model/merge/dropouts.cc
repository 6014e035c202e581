#include "core/model/merge/dropouts.h"

#include <algorithm>
#include <cmath>

namespace vantage::model {
namespace {

constexpr size_t kMostDropouts = 8;  // kept of a voxel: 96 bytes, as two voxels take
// Cosine, 3 degrees: what drops out in one direction drops out beside it. A third of what planning
// takes for the same direction (CellArrays::IsDropout), so that which one is kept does not matter.
const float kSameDirection = std::cos(static_cast<float>(sensor::Radians(3)));

}  // namespace

bool IsDropout(const ScanLayer& layer, const SurfaceVoxel& surface, double voxel_size) {
  const Eigen::Vector3d centroid = surface.centroid.cast<double>();
  const Eigen::Vector3d normal = surface.normal.cast<double>();
  if (layer.MissAt(centroid, normal, voxel_size) != ScanLayer::Miss::kSquare) return false;
  return layer.DensityAt(centroid, normal, voxel_size).at_point > 0;
}

bool MayHaveDropouts(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size) {
  if (layer.holes.empty()) return false;
  const double side = Brick::kSide * voxel_size;
  const Eigen::Vector3d middle = (brick.cast<double>().array() + 0.5) * side;
  const Eigen::Vector3d away = middle - layer.T_model_scan.translation();
  const double distance = away.norm();
  const double radius = 0.5 * std::sqrt(3.0) * side;
  if (distance - radius > layer.scanner.range_max) return false;
  if (distance <= radius) return true;
  return layer.holes.Near(layer.T_model_scan.linear().transpose() * away,
                          std::asin(radius / distance));
}

std::vector<BrickKey> BricksWithDropouts(const ScanLayer& layer, const ModelOctree& octree,
                                         double voxel_size) {
  std::vector<BrickKey> found;
  if (layer.holes.empty()) return found;
  octree.ForEach([&](const VoxelIndex& brick, const ModelLeaf& leaf) {
    if (leaf->surface.empty() || !MayHaveDropouts(layer, brick, voxel_size)) return;
    if (std::any_of(leaf->surface.begin(), leaf->surface.end(), [&](const SurfaceVoxel& surface) {
          return !surface.given_up && IsDropout(layer, surface, voxel_size);
        })) {
      found.push_back(KeyOf(brick));
    }
  });
  return found;
}

std::vector<Eigen::Vector3f> NearestDropouts(const Eigen::Vector3f& centroid,
                                             std::vector<Eigen::Vector3f> from) {
  std::stable_sort(from.begin(), from.end(), [&](const auto& a, const auto& b) {
    return (a - centroid).squaredNorm() < (b - centroid).squaredNorm();
  });
  std::vector<Eigen::Vector3f> kept;
  for (const Eigen::Vector3f& dropout : from) {
    if (kept.size() == kMostDropouts) break;
    const Eigen::Vector3f direction = (dropout - centroid).normalized();
    const bool said = std::any_of(kept.begin(), kept.end(), [&](const auto& nearer) {
      return direction.dot((nearer - centroid).normalized()) >= kSameDirection;
    });
    if (!said) kept.push_back(dropout);
  }
  return kept;
}

}  // namespace vantage::model
