// What dense scans leave in memory: the same scene at 2 and at 40 million samples, and many scans
// of two million.
#include <cstdint>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

constexpr double kTwoMillion = 0.158;  // degrees
constexpr double kFortyMillion = 0.0353;

sensor::Scan Dense(const simulation::SimulatedScanner& simulated, double step_degrees,
                   const Eigen::Isometry3d& pose, uint64_t seed, parallel::Parallel& parallel) {
  sensor::Scan scan;
  scan.scanner.range_max = 60;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(step_degrees);
  scan.image = simulated.Scan(scan.scanner, pose, simulation::ScanFaults{}, seed, parallel);
  return scan;
}

// MB that a model holds after one scan.
double Kept(const sensor::Scan& scan, const Eigen::Isometry3d& pose, size_t& surface) {
  // The allocator keeps an arena for each thread, and how they fill is left to chance.
  parallel::Serial serial;
  const auto model = model::PartialModel::Create({}).value();
  const double before = test_support::ResidentMegabytes();
  surface = model->Insert("scan", scan, pose, serial).value().surface_voxels;
  return test_support::ResidentMegabytes() - before;
}

void BenchResidentRatio(const BenchOptions& options, parallel::Parallel& parallel,
                        Figures& figures) {
  const simulation::Scene scene = simulation::FurnishedFlat(SceneSeeds(options.use).front());
  const simulation::SimulatedScanner simulated(scene.mesh);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(scene.starts.front());
  double megabytes[2];
  size_t cells[2];
  size_t surface[2];
  for (int i = 0; i < 2; ++i) {
    const sensor::Scan scan =
        Dense(simulated, i == 0 ? kTwoMillion : kFortyMillion, pose, 1, parallel);
    cells[i] = scan.image.cells();
    megabytes[i] = Kept(scan, pose, surface[i]);
  }
  figures.Add({"scan.resident_ratio", megabytes[1] / megabytes[0], "", "1.1",
               absl::StrFormat("one scan of a flat: %.1f MB (%.1f M cells, %d surface voxels) over "
                               "%.1f MB (%.1f M, %d)",
                               megabytes[1], 1e-6 * static_cast<double>(cells[1]), surface[1],
                               megabytes[0], 1e-6 * static_cast<double>(cells[0]), surface[0])});
}

// Places all over the rooms of a scene, as far from all things as a tripod is wide.
std::vector<Eigen::Isometry3d> PlacesIn(const simulation::Scene& scene,
                                        const simulation::SimulatedScanner& simulated,
                                        size_t count) {
  constexpr double kTripod = 1.5;      // m over the floor
  constexpr double kRoomAround = 0.5;  // m
  std::mt19937_64 random(1);
  std::vector<Eigen::Isometry3d> places;
  while (places.size() < count) {
    const simulation::Room& room = scene.rooms[places.size() % scene.rooms.size()];
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    do {
      const auto within = [&](int axis) {
        return std::uniform_real_distribution(room.inside.min()[axis],
                                              room.inside.max()[axis])(random);
      };
      place.translation() = Eigen::Vector3d(within(0), within(1), scene.floor_height + kTripod);
    } while (simulated.Clearance(place.translation(), kRoomAround) < kRoomAround);
    places.push_back(place);
  }
  return places;
}

// A job of a week.
void BenchManyScans(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  constexpr size_t kScans = 200;
  const simulation::Scene scene = simulation::OfficeStorey(SceneSeeds(options.use).front(), 1000);
  const simulation::SimulatedScanner simulated(scene.mesh);
  const auto model = model::PartialModel::Create({}).value();
  const double before = test_support::ResidentMegabytes();
  size_t cells = 0;
  uint64_t seed = 0;
  for (const Eigen::Isometry3d& place : PlacesIn(scene, simulated, kScans)) {
    const sensor::Scan scan = Dense(simulated, kTwoMillion, place, ++seed, parallel);
    cells += scan.image.cells();
    (void)model->Insert(absl::StrCat("scan-", seed), scan, place, parallel).value();
    if (seed % 20 == 0) {
      std::cerr << absl::StrFormat("scans200: %d scans, %.0f MB\n", seed,
                                   test_support::ResidentMegabytes() - before);
    }
  }
  const double resident = test_support::ResidentMegabytes() - before;
  const double account = 1e-6 * static_cast<double>(model->Bytes());
  figures.Add(
      {"scans200.mb", resident, "MB", "",
       absl::StrFormat("%d scans of %.1f M cells in %d rooms of an office of 1,000 m2; %.0f "
                       "MB by the account",
                       kScans, 1e-6 * static_cast<double>(cells) / kScans, scene.rooms.size(),
                       account)});
}

}  // namespace

void BenchLargeScans(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("scan.resident_ratio")) BenchResidentRatio(options, parallel, figures);
  if (options.full && figures.Wants("scans200.")) BenchManyScans(options, parallel, figures);
}

}  // namespace vantage::bench
