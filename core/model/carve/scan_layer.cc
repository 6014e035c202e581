#include "core/model/carve/scan_layer.h"

#include <algorithm>
#include <cmath>

#include "core/model/scan/sky.h"

namespace vantage::model {

size_t ScanLayer::Bytes() const {
  size_t bytes = sizeof(ScanLayer) + range_surface.bytes() + bricks.bytes();
  for (const SuspectedReflector& suspect : suspects) {
    bytes += sizeof(suspect) + suspect.asked.size() * sizeof(ScanCell);
  }
  for (const auto& [key, brick] : set_aside) {
    bytes += sizeof(key) + sizeof(brick) + brick.sums.bytes();
  }
  return bytes;
}

UnknownReason ScanLayer::ReasonAt(const Eigen::Vector3d& point) const {
  if (!WithinSite(point)) return UnknownReason::kSite;
  for (const Aperture& aperture : apertures) {
    if (aperture.Between(T_model_scan.translation(), point)) return UnknownReason::kHole;
  }
  const Eigen::Vector3d in_scan = T_model_scan.inverse(Eigen::Isometry) * point;
  const RangeSurface::Reading reading = range_surface.Read(in_scan);
  if (in_scan.norm() < static_cast<double>(reading.range)) return UnknownReason::kNone;
  return reading.beyond;
}

bool ScanLayer::InSky(const Eigen::Vector3d& point, double voxel_size) const {
  if (!range_surface.EndsInSky()) return false;
  const double reach = SkyRange(scanner) + 2 * std::sqrt(3.0) * voxel_size;
  if ((point - T_model_scan.translation()).squaredNorm() > reach * reach) return false;
  return ReasonAt(point) == UnknownReason::kSky;
}

ScanLayer::Miss ScanLayer::MissAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                  double voxel_size) const {
  const Eigen::Vector3d to_scanner = T_model_scan.translation() - point;
  const double distance = to_scanner.norm();
  if (distance < scanner.range_min || distance > scanner.range_max) return Miss::kNone;
  UnknownReason reason = ReasonAt(point);
  if (reason == UnknownReason::kNone) {
    reason = ReasonAt(point - to_scanner * (voxel_size / distance));
  }
  if (reason != UnknownReason::kHole) return Miss::kNone;
  // Either side counts: a ray that never came back crossed the element.
  const bool askew = std::abs(normal.dot(to_scanner)) < std::cos(scanner.max_incidence) * distance;
  return askew ? Miss::kAskew : Miss::kSquare;
}

ScanLayer::Density ScanLayer::DensityAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                        double voxel_size, double best) const {
  const Eigen::Vector3d origin = T_model_scan.translation();
  const double cos_limit = std::cos(scanner.max_incidence);
  const Eigen::Vector3d tangent_u = normal.unitOrthogonal();
  const Eigen::Vector3d tangent_v = normal.cross(tangent_u);
  Density density{std::numeric_limits<double>::infinity(), 0};
  for (const auto& [u, v] :
       {std::pair{0.0, 0.0}, {-0.5, -0.5}, {-0.5, 0.5}, {0.5, -0.5}, {0.5, 0.5}}) {
    const Eigen::Vector3d to_point = point + voxel_size * (u * tangent_u + v * tangent_v) - origin;
    const double distance = to_point.norm();
    const double cos_incidence = -normal.dot(to_point) / distance;
    // The centre decides whether the element counts; its surroundings only lower the figure.
    if (u == 0 && (cos_incidence < cos_limit || distance < scanner.range_min)) return {};
    const Eigen::Vector3d in_scan = T_model_scan.linear().transpose() * to_point;
    const double sine = in_scan.z() / distance;
    const double here = scanner.SamplingDensityAtSine(sine, cos_incidence, distance);
    if (u == 0) {
      const double elevation = std::asin(std::clamp(sine, -1.0, 1.0));
      if (elevation < elevation_first || elevation > elevation_last) return {};
      density.at_point = here;
    }
    density.recorded = std::min(density.recorded, here);
    if (density.recorded <= best) break;
  }
  return density;
}

}  // namespace vantage::model
