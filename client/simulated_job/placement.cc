#include "client/simulated_job/placement.h"

#include <cmath>

#include "core/simulation/random_sequence.h"
#include "core/simulation/standable_positions.h"

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
  kAgain = 114
};

constexpr double kTripodRadius = 0.15;  // m that must really be free to stand

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

Placement FirstPlacement(const Vector3d& start, const PlacementErrors& errors) {
  Placement placement;
  placement.T_scene_scan = Tilted(start, YawOf(1, errors), 1, errors);
  return placement;
}

Placement PlacementAt(const Vector3d& planned, int number, const Isometry3d& T_scene_world,
                      const PlacementErrors& errors) {
  const auto index = static_cast<uint64_t>(number);
  const auto normal = [&](Stream stream) {
    return simulation::RandomNormal(errors.seed, index, stream);
  };
  const double yaw = YawOf(index, errors);
  Placement placement;
  placement.planned = planned;
  placement.T_world_scan = Tilted(
      planned + errors.position * Vector3d(normal(kPlaceX), normal(kPlaceY), normal(kPlaceZ)), yaw,
      index, errors);
  placement.T_scene_scan = T_scene_world * placement.T_world_scan;
  placement.prior.emplace();
  placement.prior->T_world_scan = Upright(planned, yaw + errors.heading * normal(kHeading));
  return placement;
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

std::vector<Vector3d> AllowedPositions(const simulation::SimulatedScanner& tracer, const Site& site,
                                       const sensor::ScannerModel& scanner) {
  std::vector<Vector3d> positions;
  for (const double height : {1.2, 1.8}) {
    Vector3d start = site.start;
    start.z() = site.floor_height + height;
    const std::vector<Vector3d> level =
        site.level
            ? simulation::StandablePositions(tracer, site.mesh.Bounds(), start, site.floor_height,
                                             height, scanner.clearance, kLatticeOfTruth)
            : simulation::StandablePositionsOnGround(tracer, site.mesh.Bounds(), start, height,
                                                     scanner.clearance, kLatticeOfTruth);
    positions.insert(positions.end(), level.begin(), level.end());
  }
  return positions;
}

}  // namespace vantage::simulated_job
