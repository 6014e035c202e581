// Compares what the server's account is told that scans and plans take with what they take.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/str_format.h"
#include "core/model/insert_estimate.h"
#include "core/model/partial_model.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

struct AccountCase {
  const char* name;
  simulation::Scene (*scene)(uint64_t);
  double range;         // m
  double step_degrees;  // 0.047: 24 million cells
  bool plans;           // that of the hall is plan.hall100.mb
};
constexpr std::array kCases = {
    AccountCase{"room", simulation::TwoRooms, 20, 0.25, true},
    AccountCase{"flat", simulation::FurnishedFlat, 20, 0.25, true},
    AccountCase{"flat, 24 M cells", simulation::FurnishedFlat, 20, 0.047, false},
    AccountCase{"hall of 100 x 60 x 15 m", simulation::LargeHall, 130, 0.25, false},
    AccountCase{"hall, 24 M cells", simulation::LargeHall, 130, 0.047, false}};

// How far off the estimates are, as a share of what was taken, and in words.
struct AccountError {
  double worst = 0;
  std::string words;

  void Add(const char* name, const char* what, double said, double took) {
    const double error = said / took - 1;
    worst = std::max(worst, std::abs(error));
    absl::StrAppendFormat(&words, "%s%s %s: %.0f of %.0f MB", words.empty() ? "" : "; ", name, what,
                          said, took);
  }
};

}  // namespace

void BenchMemory(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("memory.account.") || !test_support::ResetPeak()) return;
  AccountError merges;
  AccountError plans;
  // The allocator keeps an arena for each thread, and how they fill is left to chance.
  parallel::Serial serial;
  for (const AccountCase& of : kCases) {
    const simulation::Scene scene = of.scene(SceneSeeds(options.use).front());
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(scene.starts.front());
    sensor::Scan scan;
    scan.scanner.range_max = of.range;
    scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(of.step_degrees);
    scan.image = simulation::SimulatedScanner(scene.mesh)
                     .Scan(scan.scanner, pose, simulation::ScanFaults{}, 1, parallel);
    model::ModelConfig config;
    config.max_half_extent.z() = 100;
    const model::InsertSize size(scan, config);
    const auto model = model::PartialModel::Create(config).value();
    (void)test_support::ResetPeak();
    const double before = test_support::ResidentMegabytes();
    (void)model->Insert("scan", scan, pose, serial).value();
    const double peak = test_support::PeakMegabytes() - before;
    const double kept = test_support::ResidentMegabytes() - before;
    merges.Add(of.name, "merge", 1e-6 * static_cast<double>(size.PeakBytes()), peak);
    merges.Add(of.name, "model", 1e-6 * static_cast<double>(model->Bytes()), kept);
    if (!of.plans) continue;
    const std::shared_ptr<const model::PlanningView> view = model->Publish();
    (void)test_support::ResetPeak();
    const double idle = test_support::ResidentMegabytes();
    const planning::Plan plan =
        planning::MakePlan(*view, scan.scanner, {}, parallel::Budget::Unlimited(), serial,
                           [](const planning::Plan&) {})
            .value();
    plans.Add(of.name, "plan",
              1e-6 * static_cast<double>(planning::PlanningSize(*view, {}).Bytes(
                         static_cast<double>(plan.feasible_cells))),
              test_support::PeakMegabytes() - idle);
  }
  figures.Add({"memory.account.error", merges.worst, "", "0.2", merges.words});
  figures.Add({"memory.account.plan_error", plans.worst, "", "0.2", plans.words});
}

}  // namespace vantage::bench
