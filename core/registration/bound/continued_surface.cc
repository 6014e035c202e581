#include "core/registration/bound/continued_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace vantage::registration {
namespace {

// Planes are told from so many samples; a candidate lies through one of the first of them.
constexpr size_t kSamplesOfPlanes = 400;
constexpr size_t kPlaneCandidates = 48;
constexpr size_t kMostPlanes = 8;
// What lies on one: voxels' centroids scatter by a centimetre, their normals by ten degrees.
constexpr double kOnPlane = 0.04;     // m
constexpr double kSameNormal = 0.97;  // cosine
// Share of those samples, of a plane that goes on: a cupboard's front has less.
constexpr double kLeastShareOfPlane = 0.04;
// Between samples, m: ten on a square metre are as many as a forecast takes of what is known. More
// where a plane is in sight for more than twenty of that to either side.
constexpr double kContinuedSpacing = 0.3;
constexpr double kMostContinuedSteps = 20;
constexpr size_t kMostContinued = 1000;
// Along a line of sight, voxels: a wall is seen as one voxel thick.
constexpr double kSightStep = 0.8;
constexpr double kSightFrom = 0.3;  // m: nearer there is only the tripod
constexpr double kPastPlane = 0.1;  // m, behind a plane

struct SeenPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // towards the scanner
  double away = 0;                                    // m, of the scanner, > 0
  double Before(const Eigen::Vector3d& point) const { return normal.dot(point) + away; }
};

std::vector<SeenPlane> PlanesOf(std::span<const SurfaceSample> seen) {
  std::vector<const SurfaceSample*> left;
  for (const SurfaceSample& s : seen.first(std::min(kSamplesOfPlanes, seen.size()))) {
    left.push_back(&s);
  }
  const double least = kLeastShareOfPlane * static_cast<double>(left.size());
  std::vector<SeenPlane> planes;
  while (planes.size() < kMostPlanes) {
    SeenPlane best;
    double most = 0;
    const auto on = [](const SeenPlane& plane, const SurfaceSample& s) {
      return plane.normal.dot(s.normal.cast<double>()) > kSameNormal &&
             std::abs(plane.Before(s.point.cast<double>())) < kOnPlane;
    };
    for (size_t k = 0; k < std::min(kPlaneCandidates, left.size()); ++k) {
      SeenPlane plane{left[k]->normal.cast<double>(), 0};
      plane.away = -plane.normal.dot(left[k]->point.cast<double>());
      const auto held = static_cast<double>(std::count_if(
          left.begin(), left.end(), [&](const SurfaceSample* s) { return on(plane, *s); }));
      if (held > most) {
        most = held;
        best = plane;
      }
    }
    if (most == 0 || most < least) break;
    // The mean of what lies on it goes on straighter than one voxel's normal.
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double away = 0;
    std::vector<const SurfaceSample*> others;
    for (const SurfaceSample* s : left) {
      if (on(best, *s)) {
        normal += s->normal.cast<double>();
      } else {
        others.push_back(s);
      }
    }
    normal.normalize();
    for (const SurfaceSample* s : left) {
      if (on(best, *s)) away -= normal.dot(s->point.cast<double>());
    }
    planes.push_back({normal, away / most});
    left = std::move(others);
  }
  return planes;
}

bool NotSeen(model::VoxelState state) {
  return state == model::VoxelState::kUnknown || model::IsFalseSurface(state);
}

}  // namespace

std::vector<SurfaceSample> ContinuedSurface(const model::PlanningView& model,
                                            std::span<const SurfaceSample> seen,
                                            const Eigen::Vector3d& position,
                                            const sensor::ScannerModel& scanner) {
  const std::vector<SeenPlane> planes = PlanesOf(seen);
  const double h = model.voxel_size();
  const auto state = [&](const Eigen::Vector3d& point) {
    return model.State(model.At(position + point));
  };
  // Not past surface that is known, nor past a plane where that goes on itself.
  const auto in_sight = [&](const Eigen::Vector3d& point) {
    const double range = point.norm();
    for (const SeenPlane& plane : planes) {
      const double before = plane.Before(point);
      if (before > -kPastPlane || !(plane.away > 0)) continue;
      if (NotSeen(state(plane.away / (plane.away - before) * point))) return false;
    }
    for (double t = kSightFrom; t < range - 2 * h; t += kSightStep * h) {
      const model::VoxelState at = state(t / range * point);
      if (at != model::VoxelState::kEmpty && !NotSeen(at)) return false;
    }
    return true;
  };
  // A plane passes a centimetre before or behind a wall's voxels.
  const auto unmeasured = [&](const Eigen::Vector3d& point, const SeenPlane& plane) {
    return NotSeen(state(point)) &&
           state(point + h * plane.normal) != model::VoxelState::kTrueSurface &&
           state(point - h * plane.normal) != model::VoxelState::kTrueSurface;
  };
  std::vector<std::pair<Eigen::Vector3d, const SeenPlane*>> points;
  for (const SeenPlane& plane : planes) {
    if (!(plane.away > 0) || plane.away >= scanner.range_max) continue;
    const double radius =
        std::min(plane.away * std::tan(scanner.max_incidence),
                 std::sqrt(scanner.range_max * scanner.range_max - plane.away * plane.away));
    const double spacing = std::max(kContinuedSpacing, radius / kMostContinuedSteps);
    const Eigen::Vector3d u = plane.normal.unitOrthogonal();
    const Eigen::Vector3d v = plane.normal.cross(u);
    const int steps = static_cast<int>(radius / spacing);
    for (int j = -steps; j <= steps; ++j) {
      for (int i = -steps; i <= steps; ++i) {
        const Eigen::Vector3d point = spacing * i * u + spacing * j * v - plane.away * plane.normal;
        if (unmeasured(point, plane)) points.emplace_back(point, &plane);
      }
    }
  }
  std::vector<SurfaceSample> samples;
  for (const auto& [point, plane] : points) {
    const double range = point.norm();
    const double cos_incidence = plane->away / range;
    const double elevation = std::asin(std::clamp(point.z() / range, -1.0, 1.0));
    if (!(cos_incidence > std::cos(scanner.max_incidence)) || range > scanner.range_max ||
        range < scanner.range_min || elevation < scanner.elevation_min ||
        elevation > scanner.elevation_max) {
      continue;
    }
    const double cells = scanner.SamplingDensity(elevation, cos_incidence, range) * h * h;
    if (cells < 1) continue;
    SurfaceSample sample;
    sample.point = point.cast<float>();
    sample.normal = plane->normal.cast<float>();
    sample.sigma = static_cast<float>(scanner.RangeSigma(range) * cos_incidence);
    sample.cells = static_cast<float>(cells);
    samples.push_back(sample);
  }
  if (samples.size() > kMostContinued) {
    const size_t stride = (samples.size() + kMostContinued - 1) / kMostContinued;
    size_t kept = 0;
    for (size_t k = 0; k < samples.size(); k += stride) samples[kept++] = samples[k];
    samples.resize(kept);
  }
  std::erase_if(samples, [&](const SurfaceSample& s) { return !in_sight(s.point.cast<double>()); });
  return samples;
}

}  // namespace vantage::registration
