#include "client/simulated_job/site.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/error.h"
#include "core/parallel/parallel.h"
#include "core/simulation/confined_mesh.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {
namespace {

constexpr double kStationRoom = 0.35;  // m kept free around a start
constexpr double kViewHeight = 1.5;    // m over the floor
constexpr double kLattice = 0.5;       // m between places that are tried as start

// m from a point down to the surface below it, at most `limit`.
double DropBelow(const simulation::SimulatedScanner& tracer, const Eigen::Vector3d& from,
                 double limit) {
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
double Enclosure(const simulation::SimulatedScanner& tracer, const Eigen::Vector3d& place) {
  sensor::ScannerModel coarse;
  coarse.azimuth_step = coarse.elevation_step = sensor::Radians(10);
  coarse.elevation_min = sensor::Radians(-80);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = place;
  parallel::Serial serial;
  const sensor::RangeImage image =
      tracer.Scan(coarse, pose, simulation::ScanFaults::None(), 1, serial);
  return static_cast<double>(image.SampleCount()) / static_cast<double>(image.cells());
}

std::optional<Eigen::Vector3d> FindStart(const simulation::SimulatedScanner& tracer,
                                         const Eigen::AlignedBox3d& bounds) {
  std::optional<Eigen::Vector3d> best;
  double best_merit = 0;
  const Eigen::Vector3d centre = bounds.center();
  for (double x = bounds.min().x() + kLattice; x < bounds.max().x(); x += kLattice) {
    for (double y = bounds.min().y() + kLattice; y < bounds.max().y(); y += kLattice) {
      const Eigen::Vector3d place(x, y, bounds.min().z() + kViewHeight);
      if (tracer.Clearance(place, 2 * kStationRoom) < kStationRoom) continue;
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

constexpr char kAdvice[] = "name a free place inside with --start x,y,z";

absl::Status CheckStart(const simulation::TriangleMesh& mesh,
                        const simulation::SimulatedScanner& tracer, const Eigen::Vector3d& start) {
  if (mesh.Bounds().contains(start) && tracer.Clearance(start, 0.4) >= 0.2) {
    return absl::OkStatus();
  }
  return client::WithFix(
      absl::InvalidArgumentError(
          absl::StrFormat("the start (%.2f, %.2f, %.2f) is outside the mesh or within 0.2 m of a "
                          "surface",
                          start.x(), start.y(), start.z())),
      kAdvice);
}

}  // namespace

absl::StatusOr<Site> GeneratedSite(SceneKind kind, uint64_t seed, double area,
                                   const std::optional<Eigen::Vector3d>& start) {
  simulation::Scene scene;
  std::string what;
  switch (kind) {
    case SceneKind::kFlat:
      scene = simulation::FurnishedFlat(seed);
      what = "furnished flat";
      break;
    case SceneKind::kTwoRooms:
      scene = simulation::TwoRooms(seed);
      what = "two rooms";
      break;
    case SceneKind::kHall:
      scene = simulation::PillarHall(seed);
      what = "hall with pillars";
      break;
    case SceneKind::kOffice:
      scene = simulation::OfficeStorey(seed, area);
      what = absl::StrFormat("office storey of %.0f m\u00b2", area);
      break;
    case SceneKind::kHouse:
      scene = simulation::HouseOfThreeStoreys(seed);
      what = "house of three storeys";
      break;
    case SceneKind::kFacade:
      scene = simulation::FacadeScene(seed);
      what = "facade on a square";
      break;
    case SceneKind::kCourtyard:
      scene = simulation::CourtyardScene(seed);
      what = "courtyard";
      break;
    case SceneKind::kStreet:
      scene = simulation::StreetScene(seed);
      what = "street with two houses";
      break;
    case SceneKind::kSlope:
      scene = simulation::SlopeScene(seed);
      what = "sloping ground with a hut";
      break;
  }
  Site site;
  site.name = absl::StrCat(what, " ", seed);
  site.floor_height = scene.floor_height;
  site.several_levels = scene.several_levels;
  site.start = start.value_or(scene.starts.front());
  site.mesh = std::move(scene.mesh);
  site.doorways = std::move(scene.doorways);
  site.rooms = std::move(scene.rooms);
  if (start) {
    const absl::Status free =
        CheckStart(site.mesh, simulation::SimulatedScanner(site.mesh), *start);
    if (!free.ok()) return free;
  }
  return site;
}

absl::StatusOr<Site> MeshSite(const std::string& path, const std::optional<Eigen::Vector3d>& start,
                              const confinement::AllowanceSettings& allowance) {
  auto mesh = simulation::ReadMeshConfined(path, allowance);
  if (!mesh.ok()) return mesh.status();
  const simulation::SimulatedScanner tracer(*mesh);
  const std::optional<Eigen::Vector3d> place = start ? start : FindStart(tracer, mesh->Bounds());
  if (!place) {
    return client::WithFix(absl::InvalidArgumentError(absl::StrCat(
                               path, " has no free place to stand at the height of a tripod")),
                           kAdvice);
  }
  if (absl::Status free = CheckStart(*mesh, tracer, *place); !free.ok()) return free;
  Site site;
  site.name = std::filesystem::path(path).filename().string();
  site.start = *place;
  site.floor_height = place->z() - DropBelow(tracer, *place, 5.0);
  site.mesh = *std::move(mesh);
  return site;
}

}  // namespace vantage::simulated_job
