#include "client/simulation/site.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/error.h"
#include "core/parallel/parallel.h"
#include "core/simulation/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage {
namespace {

constexpr double kStandRoom = 0.35;  // m kept free around a start
constexpr double kViewHeight = 1.5;  // m over the floor
constexpr double kLattice = 0.5;     // m between places that are tried as start

// m from a point down to the surface below it, at most `limit`.
double DropBelow(const SimulatedScanner& tracer, const Eigen::Vector3d& from, double limit) {
  double clear = 0;
  double blocked = limit;
  if (tracer.Visible(from, from - Eigen::Vector3d(0, 0, limit))) return limit;
  while (blocked - clear > 1e-4) {
    const double middle = 0.5 * (clear + blocked);
    (tracer.Visible(from, from - Eigen::Vector3d(0, 0, middle)) ? clear : blocked) = middle;
  }
  return clear;
}

// The share of directions in which a place sees something within 20 m.
double Enclosure(const SimulatedScanner& tracer, const Eigen::Vector3d& place) {
  ScannerModel coarse;
  coarse.azimuth_step = coarse.elevation_step = Radians(10);
  coarse.elevation_min = Radians(-80);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = place;
  Serial serial;
  const RangeImage image = tracer.Scan(coarse, pose, ScanFaults::None(), 1, serial);
  return static_cast<double>(image.SampleCount()) / static_cast<double>(image.cells());
}

std::optional<Eigen::Vector3d> FindStart(const SimulatedScanner& tracer,
                                         const Eigen::AlignedBox3d& bounds) {
  std::optional<Eigen::Vector3d> best;
  double best_merit = 0;
  const Eigen::Vector3d centre = bounds.center();
  for (double x = bounds.min().x() + kLattice; x < bounds.max().x(); x += kLattice) {
    for (double y = bounds.min().y() + kLattice; y < bounds.max().y(); y += kLattice) {
      const Eigen::Vector3d place(x, y, bounds.min().z() + kViewHeight);
      if (tracer.Clearance(place, 2 * kStandRoom) < kStandRoom) continue;
      if (DropBelow(tracer, place, 2 * kViewHeight) < kViewHeight - 0.3) continue;
      // Inside before outside, the middle before the edge.
      const double merit =
          Enclosure(tracer, place) - 0.1 * (place - centre).norm() / bounds.diagonal().norm();
      if (!best || merit > best_merit) {
        best = place;
        best_merit = merit;
      }
    }
  }
  return best;
}

}  // namespace

Site FlatSite(uint64_t seed) {
  Scene scene = FurnishedFlat(seed);
  Site site;
  site.name = absl::StrCat("furnished flat ", seed);
  site.floor_height = scene.floor_height;
  site.start = scene.starts.empty() ? Eigen::Vector3d(0, 0, scene.floor_height + kViewHeight)
                                    : scene.starts.front();
  site.mesh = std::move(scene.mesh);
  return site;
}

absl::StatusOr<Site> MeshSite(const std::string& path,
                              const std::optional<Eigen::Vector3d>& start) {
  auto mesh = ReadPly(path);
  if (!mesh.ok()) return mesh.status();
  const SimulatedScanner tracer(*mesh);
  const std::optional<Eigen::Vector3d> place = start ? start : FindStart(tracer, mesh->Bounds());
  const std::string advice = "name a free place inside with --start x,y,z";
  if (!place) {
    return WithFix(absl::InvalidArgumentError(
                       absl::StrCat(path, " has no free place to stand at the height of a tripod")),
                   advice);
  }
  if (!mesh->Bounds().contains(*place) || tracer.Clearance(*place, 0.4) < 0.2) {
    return WithFix(absl::InvalidArgumentError(absl::StrFormat(
                       "the start (%.2f, %.2f, %.2f) is outside the mesh or within 0.2 m of a "
                       "surface",
                       place->x(), place->y(), place->z())),
                   advice);
  }
  Site site;
  site.name = std::filesystem::path(path).filename().string();
  site.start = *place;
  site.floor_height = place->z() - DropBelow(tracer, *place, 5.0);
  site.mesh = *std::move(mesh);
  return site;
}

}  // namespace vantage
