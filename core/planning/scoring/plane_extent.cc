#include "core/planning/scoring/plane_extent.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace vantage::planning {
namespace {

constexpr float kSimilar = 0.9f;   // cosine, 26 degrees: five sigma of two noisy normals
constexpr double kOffPlane = 0.4;  // voxels: a noise of up to a fifth
// Samples across a plane: the one whose normal is sought and two to either side. What reaches
// beyond the plane's edge lies on something else, and the neighbourhood is no plane
// (SampleSurface()). By jobs of a scanner that sees 120 degrees, 3 are too few, and 6 give no more
// (core/planning/experiments.md, "Scanners that see a sector").
constexpr double kSamplesAcross = 5;
// m to either side. Where samples lie farther apart than a fifth of twice that, 24 cm, hardly any
// plane indoors has five.
constexpr double kFarthest = 0.6;

// Whether `other` goes on with the plane of `surface`.
bool InPlane(const model::PlanningView& model, const model::SurfaceVoxel& surface,
             const model::VoxelIndex& other) {
  if (model.State(other) != model::VoxelState::kTrueSurface) return false;
  const std::optional<model::SurfaceVoxel> found = model.Surface(other);
  const auto off = static_cast<float>(kOffPlane * model.voxel_size());
  return found->normal.dot(surface.normal) >= kSimilar &&
         std::abs(surface.normal.dot(found->centroid - surface.centroid)) <= off;
}

// A surface on the border of two voxels is in either: so the neighbours along the normal count.
bool GoesOnAt(const model::PlanningView& model, const model::SurfaceVoxel& surface,
              const Eigen::Vector3f& point) {
  int axis = 0;
  surface.normal.cwiseAbs().maxCoeff(&axis);
  const model::VoxelIndex along = model::VoxelIndex::Unit(axis);
  const model::VoxelIndex at = model.At(point.cast<double>());
  return InPlane(model, surface, at) || InPlane(model, surface, at + along) ||
         InPlane(model, surface, at - along);
}

float Along(const Eigen::Vector3f& direction, const model::PlanningView& model,
            const model::SurfaceVoxel& surface) {
  const auto voxel = static_cast<float>(model.voxel_size());
  const int most = static_cast<int>(std::ceil(kFarthest / model.voxel_size()));
  int count = 1;
  for (const float side : {voxel, -voxel}) {
    int k = 1;
    while (k <= most &&
           GoesOnAt(model, surface, surface.centroid + static_cast<float>(k) * side * direction)) {
      ++k;
    }
    count += k - 1;
  }
  return static_cast<float>(count) * voxel;
}

// m between neighbouring samples along a direction in the plane.
double Spacing(const Eigen::Vector3f& direction, const Eigen::Vector3f& ray,
               const sensor::ScannerModel& scanner) {
  const double range = ray.norm();
  const double along = direction.dot(ray) / range;
  const double across = std::sqrt(std::max(1e-6, 1 - along * along));
  return range * std::max(scanner.azimuth_step, scanner.elevation_step) / across;
}

}  // namespace

bool LiesInPlane(const model::PlanningView& model, const model::VoxelIndex& v,
                 const model::SurfaceVoxel& surface) {
  constexpr int kFewest = 6;  // with itself; a plane meets nine or more of the 27
  int count = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        count += InPlane(model, surface, v + model::VoxelIndex(x, y, z)) ? 1 : 0;
      }
    }
  }
  return count >= kFewest;
}

PlaneExtent ExtentOfPlane(const model::PlanningView& model, const model::SurfaceVoxel& surface) {
  constexpr float kUpright = 0.1f;  // sine of 6 degrees, beyond which a plane has a level direction
  PlaneExtent extent;
  const Eigen::Vector3f level = Eigen::Vector3f::UnitZ().cross(surface.normal);
  if (level.norm() > kUpright) extent.level = level.normalized();
  extent.upward = surface.normal.cross(extent.level).normalized();
  extent.along_level = Along(extent.level, model, surface);
  extent.along_upward = Along(extent.upward, model, surface);
  return extent;
}

bool FindsPlane(const PlaneExtent& extent, const Eigen::Vector3f& ray,
                const sensor::ScannerModel& scanner) {
  return extent.along_level >= kSamplesAcross * Spacing(extent.level, ray, scanner) &&
         extent.along_upward >= kSamplesAcross * Spacing(extent.upward, ray, scanner);
}

}  // namespace vantage::planning
