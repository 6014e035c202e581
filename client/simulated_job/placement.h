// The true pose of a simulated scanner, and the prior that its surveyor has.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_PLACEMENT_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_PLACEMENT_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/simulated_job/site.h"
#include "core/parallel/parallel.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {

// The errors of a surveyor, one sigma each.
struct PlacementErrors {
  uint64_t seed = 1;
  double position = 0.05;               // m per axis
  double heading = sensor::Radians(5);  // rad, of the prior's heading
  double tilt = sensor::Radians(0.5);   // rad, of the tripod's roll and pitch
  // m, what the priors say of their positions; nothing: they are guesses, which say nothing.
  std::optional<double> stated_position = std::nullopt;
};

struct Placement {
  Eigen::Vector3d planned = Eigen::Vector3d::Zero();               // m, world
  Eigen::Isometry3d T_scene_scan = Eigen::Isometry3d::Identity();  // the truth
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();  // the truth; not for the first
  std::optional<sensor::PosePrior> prior;
};

// The first scan: upright but for the tilt, exactly at `start` (m, scene frame), turned to
// `heading` (rad, scene frame) or at random.
Placement FirstPlacement(const Eigen::Vector3d& start, const PlacementErrors& errors,
                         std::optional<double> heading = std::nullopt);

// Scan `number`, meant to be at `planned` (m, world) and turned to `heading` (rad, world), which is
// missed by two degrees (one sigma), or at random. The prior is the planned position, upright.
Placement PlacementAt(const Eigen::Vector3d& planned, int number,
                      const Eigen::Isometry3d& T_scene_world, const PlacementErrors& errors,
                      std::optional<double> heading = std::nullopt);

// The heading (rad, scene frame) in which a scanner that sees a sector has most space before it:
// who begins a job does not face a wall. Nothing for scanners that turn all around.
std::optional<double> FirstHeading(const simulation::SimulatedScanner& tracer,
                                   const sensor::ScannerModel& scanner,
                                   const Eigen::Vector3d& start, parallel::Parallel& parallel);

// What a surveyor measures with tape and compass when a scan did not align: 2 cm, 1 degree.
sensor::PosePrior MeasuredPrior(const Placement& placement, int number,
                                const PlacementErrors& errors);

// True when a tripod really fits there.
bool CanStand(const simulation::SimulatedScanner& scanner, const Placement& placement);

// Where somebody sets up who is sent to a place that is expected and not known.
struct FreeSpot {
  double radius = 0;  // m, horizontally: free spots within it are as good
  std::optional<Eigen::Vector3d> doorway = std::nullopt;  // m, world: of the room that they lie in
};
// `placement` where that is free, else scan `number` at the nearest free spot that one sees from
// the doorway, or from above the place itself; `placement` where there is none.
Placement NearestFree(const simulation::SimulatedScanner& scanner, const Placement& placement,
                      const FreeSpot& spot, int number, const Eigen::Isometry3d& T_scene_world,
                      const PlacementErrors& errors, std::optional<double> heading = std::nullopt);

// What it costs to go to a place, look around and find that there is no free spot, min.
inline constexpr double kNoFreeSpotMinutes = 0.5;

// A lattice of the places that a scanner may be brought to, at two heights; m, scene frame.
inline constexpr double kLatticeOfTruth = 0.3;  // m
std::vector<Eigen::Vector3d> AllowedPositions(const simulation::SimulatedScanner& tracer,
                                              const Site& site,
                                              const sensor::ScannerModel& scanner);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_PLACEMENT_H_
