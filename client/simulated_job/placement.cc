#include "client/simulated_job/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/planning/scoring/headings.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/standable_positions.h"
#include "core/simulation/walkable_ground.h"

namespace vantage::simulated_job {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// The streams of random numbers; the index is the scan's number. A normal draw takes two streams.
enum Stream : uint64_t {
  kPlaceX = 100,
  kPlaceY = 102,
  kPlaceZ = 104,
  kYaw = 106,
  kRoll = 108,
  kPitch = 110,
  kHeading = 112,
  kAgain = 114,
  kTurn = 130
};

constexpr double kTurnError = sensor::Radians(2);  // one sigma, by which a heading is missed
constexpr double kSpotSpacing = 0.1;               // m, of free spots that one tells apart
constexpr double kTripodRadius = 0.15;             // m that must really be free to stand

Isometry3d Upright(const Vector3d& position, double yaw) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = position;
  return pose;
}

// Upright except for the tripod's tilt.
Isometry3d Tilted(const Vector3d& position, double yaw, uint64_t index,
                  const PlacementErrors& errors) {
  return Upright(position, yaw) *
         AngleAxisd(errors.tilt * simulation::RandomNormal(errors.seed, index, kRoll),
                    Vector3d::UnitX()) *
         AngleAxisd(errors.tilt * simulation::RandomNormal(errors.seed, index, kPitch),
                    Vector3d::UnitY());
}

double YawOf(uint64_t index, const PlacementErrors& errors) {
  return 2 * sensor::kPi * simulation::RandomUniform(errors.seed, index, kYaw);
}

}  // namespace

Placement FirstPlacement(const Vector3d& start, const PlacementErrors& errors,
                         std::optional<double> heading) {
  Placement placement;
  placement.T_scene_scan = Tilted(start, heading.value_or(YawOf(1, errors)), 1, errors);
  return placement;
}

Placement PlacementAt(const Vector3d& planned, int number, const Isometry3d& T_scene_world,
                      const PlacementErrors& errors, std::optional<double> heading) {
  const auto index = static_cast<uint64_t>(number);
  const auto normal = [&](Stream stream) {
    return simulation::RandomNormal(errors.seed, index, stream);
  };
  const double yaw =
      heading.has_value() ? *heading + kTurnError * normal(kTurn) : YawOf(index, errors);
  Placement placement;
  placement.planned = planned;
  placement.T_world_scan = Tilted(
      planned + errors.position * Vector3d(normal(kPlaceX), normal(kPlaceY), normal(kPlaceZ)), yaw,
      index, errors);
  placement.T_scene_scan = T_scene_world * placement.T_world_scan;
  placement.prior.emplace();
  placement.prior->T_world_scan = Upright(planned, yaw + errors.heading * normal(kHeading));
  if (errors.stated_position.has_value()) {
    const sensor::Vector6d sigma{{errors.tilt, errors.tilt, errors.heading, *errors.stated_position,
                                  *errors.stated_position, *errors.stated_position}};
    placement.prior->covariance = sigma.cwiseAbs2().asDiagonal();
  }
  return placement;
}

std::optional<double> FirstHeading(const simulation::SimulatedScanner& tracer,
                                   const sensor::ScannerModel& scanner, const Vector3d& start,
                                   parallel::Parallel& parallel) {
  if (scanner.TurnsAllAround()) return std::nullopt;
  sensor::ScannerModel look = scanner;
  look.azimuth_span = 2 * sensor::kPi;
  look.azimuth_step = look.elevation_step = sensor::Radians(2);
  const sensor::RangeImage image =
      tracer.Scan(look, Upright(start, 0), simulation::ScanFaults::None(), 1, parallel);
  const planning::Headings headings(scanner);
  std::vector<double> by_bin(headings.bins(), 0);
  for (int column = 0; column < image.columns(); ++column) {
    const double azimuth = image.azimuth[static_cast<size_t>(column)];
    double& bin = by_bin[headings.BinOf(static_cast<float>(std::cos(azimuth)),
                                        static_cast<float>(std::sin(azimuth)))];
    for (int row = 0; row < image.rows(); ++row) {
      bin += std::max(0.0, static_cast<double>(image.range[image.Index(column, row)]));
    }
  }
  std::vector<double> by_heading(headings.size());
  headings.Sum(by_bin, by_heading);
  return headings.Angle(planning::BestOf(by_heading).heading);
}

sensor::PosePrior MeasuredPrior(const Placement& placement, int number,
                                const PlacementErrors& errors) {
  const auto index = static_cast<uint64_t>(number);
  const auto normal = [&](uint64_t i) {
    return simulation::RandomNormal(errors.seed, index, kAgain + 2 * i);
  };
  const Eigen::Matrix3d& r = placement.T_world_scan.linear();
  sensor::PosePrior prior;
  prior.T_world_scan = Upright(
      placement.T_world_scan.translation() + 0.02 * Vector3d(normal(0), normal(1), normal(2)),
      std::atan2(r(1, 0), r(0, 0)) + sensor::Radians(1) * normal(3));
  return prior;
}

bool CanStand(const simulation::SimulatedScanner& scanner, const Placement& placement) {
  return scanner.Clearance(placement.T_scene_scan.translation(), 2 * kTripodRadius) >=
         kTripodRadius;
}

Placement NearestFree(const simulation::SimulatedScanner& scanner, const Placement& placement,
                      const FreeSpot& spot, int number, const Isometry3d& T_scene_world,
                      const PlacementErrors& errors, std::optional<double> heading) {
  if (CanStand(scanner, placement)) return placement;
  const Vector3d wanted = placement.planned;
  Vector3d from = wanted;
  if (spot.doorway.has_value()) from.head<2>() = spot.doorway->head<2>();
  const int reach = static_cast<int>(std::floor(spot.radius / kSpotSpacing));
  std::vector<Vector3d> spots;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const Vector3d off(x * kSpotSpacing, y * kSpotSpacing, 0);
      if (off.norm() <= spot.radius) spots.push_back(wanted + off);
    }
  }
  std::stable_sort(spots.begin(), spots.end(), [&](const Vector3d& a, const Vector3d& b) {
    return (a - wanted).squaredNorm() < (b - wanted).squaredNorm();
  });
  for (const Vector3d& at : spots) {
    // Somebody who looks through the doorway, or stands there, sees it.
    if (!scanner.Visible(T_scene_world * from, T_scene_world * at)) continue;
    Placement there = PlacementAt(at, number, T_scene_world, errors, heading);
    if (CanStand(scanner, there)) return there;
  }
  return placement;
}

std::vector<Vector3d> AllowedPositions(const simulation::SimulatedScanner& tracer, const Site& site,
                                       const sensor::ScannerModel& scanner) {
  constexpr std::array<double, 2> kHeights = {1.2, 1.8};  // m over the ground
  std::vector<Vector3d> positions;
  if (site.several_levels) {
    const simulation::WalkableGround ground(tracer, site.mesh.Bounds(), site.start);
    for (const double height : kHeights) {
      const std::vector<Vector3d> level =
          ground.Stations(height, scanner.clearance, kLatticeOfTruth);
      positions.insert(positions.end(), level.begin(), level.end());
    }
    return positions;
  }
  for (const double height : kHeights) {
    Vector3d start = site.start;
    start.z() = site.floor_height + height;
    const std::vector<Vector3d> level =
        simulation::StandablePositions(tracer, site.mesh.Bounds(), start, site.floor_height, height,
                                       scanner.clearance, kLatticeOfTruth);
    positions.insert(positions.end(), level.begin(), level.end());
  }
  return positions;
}

}  // namespace vantage::simulated_job
