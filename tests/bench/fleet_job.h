// A whole job with several simulated scanners on one model, with their ways and times.
#ifndef VANTAGE_TESTS_BENCH_FLEET_JOB_H_
#define VANTAGE_TESTS_BENCH_FLEET_JOB_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::bench {

struct FleetScene {
  simulation::Scene scene;
  sensor::ScannerModel scanner;
  double preview = 0;  // rad between the rays of its scans, which stand for native ones; 0: all
  std::unique_ptr<simulation::SimulatedScanner> tracer;
  std::unique_ptr<simulation::GroundTruth> truth;  // nothing scanned yet
  // m, where scanners stand when the job begins: the first makes the first scan there, the others
  // are a few steps away, in its sight and as far from each other as can be.
  std::vector<Eigen::Vector3d> stands;
};

// The most scanners that a scene has stands for.
inline constexpr size_t kMostFleetScanners = 8;

// A generated office storey of so many m^2.
FleetScene MakeFleetScene(uint64_t seed, double area, parallel::Parallel& parallel,
                          const sensor::ScannerModel& scanner = {}, double preview = 0);

struct FleetJobOptions {
  size_t scanners = 1;        // up to kMostFleetScanners
  bool claims = true;         // else each plans for itself, on the model that all share
  double target = 0.95;       // of what is attainable at density, where the job ends
  double speed = 1;           // m/s
  double scan_seconds = 180;  // to set up and scan
  size_t most_scans = 400;
  uint64_t plan_work = 3'000'000;  // rays
  double enough = 0.5;             // m^2 at density; no scanner is sent for less
};

struct FleetStop {
  size_t scanner = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m
  double minutes = 0;                                  // when its scan was in
  std::vector<Eigen::Vector3d> way;                    // from where it stood before
};

struct FleetJobResult {
  double minutes = 0;  // to the target, or to the end
  size_t scans = 0;
  double attained = 0;  // share of what is attainable at density
  double waste = 0;     // share of the area measured at density, over all scans, that was so before
  double times = 0;     // that area over what is at density in the end: 1 where no scans overlap
  std::vector<FleetStop> stops;
};

// Simulates the job by events with true poses, since other figures measure registration. A scanner
// that becomes free is planned for with the model at that time, ranked by score per minute.
// Scanners differ in where they begin and in the seeds of their plans, so that those that know
// nothing of each other are not sent to one place by one and the same plan.
FleetJobResult RunFleetJob(const FleetScene& scene, const FleetJobOptions& options,
                           parallel::Parallel& parallel);

// The tours over the floor plan, as SVG. False when the file cannot be written.
bool DrawTours(const FleetScene& scene, const FleetJobResult& result, const std::string& path);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_FLEET_JOB_H_
