// The brute-force scorer against Embree's own rate, and whether budgets are kept.
#include <malloc.h>

#include <bit>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/scoring.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/flat_job.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

namespace {

void BenchPackets(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                  parallel::Parallel& parallel, Figures& figures) {
  const planning::PlanningConfig config;
  const parallel::Budget unlimited = parallel::Budget::Unlimited();
  const auto problem =
      planning::PlanningProblem::Prepare({model, scanner, config}, parallel).value();
  const planning::FeasibleViews& feasible = problem->feasible();
  const planning::Scoring& scoring = problem->scoring();
  const planning::SensingConstraints constraints(scanner);
  const planning::CellArrays& cells = scoring.cells();

  // Every 40th view; their packets are laid out beforehand for Embree alone.
  struct Packets {
    Eigen::Vector3f origin;
    std::vector<std::pair<visibility::TargetPacket, uint32_t>> packets;
  };
  std::vector<Eigen::Vector3d> views;
  std::vector<Packets> raw;
  uint64_t raw_rays = 0;
  for (size_t i = 0; i < feasible.cells().size(); i += 40) {
    views.push_back(feasible.Centre(i));
    Packets of_view{scoring.scene().ToScene(views.back() / model.voxel_size()), {}};
    visibility::TargetPacket targets{};
    uint32_t filled = 0;
    alignas(32) float gains[8];
    for (size_t packet = 0; packet < cells.packets(); ++packet) {
      uint32_t bits = constraints.CellScores(views.back().cast<float>(), cells, packet, gains);
      for (; bits != 0; bits &= bits - 1) {
        const size_t at =
            packet * planning::CellArrays::kPacket + static_cast<size_t>(std::countr_zero(bits));
        targets.x[filled] = cells.tx[at];
        targets.y[filled] = cells.ty[at];
        targets.z[filled] = cells.tz[at];
        ++raw_rays;
        if (++filled == 8) {
          of_view.packets.emplace_back(targets, 0xffu);
          filled = 0;
        }
      }
    }
    if (filled > 0) of_view.packets.emplace_back(targets, (1u << filled) - 1);
    raw.push_back(std::move(of_view));
  }
  uint32_t sink = 0;
  uint64_t rays = 0;
  double brute_best = 1e9;
  double raw_best = 1e9;
  // In turn, so that a change in the machine's speed meets both.
  for (int run = 0; run < 5; ++run) {
    raw_best = std::min(raw_best, WallSeconds([&] {
                          for (const Packets& of_view : raw) {
                            for (const auto& [targets, valid] : of_view.packets) {
                              sink += scoring.scene().Occluded(of_view.origin, targets, valid);
                            }
                          }
                        }));
    brute_best = std::min(brute_best, WallSeconds([&] {
                            rays = 0;
                            for (const Eigen::Vector3d& view : views) {
                              rays += scoring.scorer().Score(view, cells, unlimited).rays;
                            }
                          }));
  }
  const double raw_rate = static_cast<double>(raw_rays) / raw_best;
  const double brute_rate = static_cast<double>(rays) / brute_best;
  figures.Add({"plan.embree.rays_per_second", raw_rate / 1e6, "M rays/s", "",
               absl::StrCat("packets of 8 alone, one thread, best of 5; ", raw_rays, " rays, ",
                            scoring.scene().faces(), " faces, checksum ", sink % 97)});
  figures.Add({"plan.brute.rays_per_second", brute_rate / 1e6, "M rays/s", "",
               absl::StrCat("the scorer on the same rays (", rays, "), cheap tests included")});
  figures.Add({"plan.brute.packet_share", brute_rate / raw_rate, "of raw", "0.7",
               "the scorer's rate over Embree's on the same rays"});
}

// `of`: the scene's part of the figures' names.
void BenchBudgets(const std::string& of, const model::PlanningView& model,
                  const sensor::ScannerModel& scanner, int runs, parallel::Parallel& parallel,
                  Figures& figures) {
  std::vector<double> over, cancelled;
  for (int run = 0; run < runs; ++run) {
    const double budget = run % 2 == 0 ? 0.05 : 0.2;
    const double took = WallSeconds([&] {
      (void)planning::MakePlan(model, scanner, {}, parallel::Budget::Seconds(budget), parallel,
                               [](const planning::Plan&) {});
    });
    over.push_back(std::max(0.0, took - budget));

    std::stop_source stop;
    parallel::Budget endless;
    endless.cancelled = stop.get_token();
    std::chrono::steady_clock::time_point asked;
    std::thread canceller([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20 + 520 * run / runs));
      asked = std::chrono::steady_clock::now();
      stop.request_stop();
    });
    (void)planning::MakePlan(model, scanner, {}, endless, parallel, [](const planning::Plan&) {});
    const auto ended = std::chrono::steady_clock::now();
    canceller.join();
    cancelled.push_back(std::max(0.0, std::chrono::duration<double>(ended - asked).count()));
  }
  figures.Add({absl::StrCat("plan.budget.", of, "over_p99"), 1e3 * Percentile(over, 0.99), "ms",
               "20", absl::StrCat("time past budgets of 50 and 200 ms, ", runs, " plans")});
  figures.Add({absl::StrCat("plan.cancel.", of, "p99"), 1e3 * Percentile(cancelled, 0.99), "ms",
               "50", absl::StrCat("from the request to the end, ", runs, " plans")});
}

// Of the process, the most since it was last reset.
double PeakGigabytes() {
  std::ifstream status("/proc/self/status");
  double kilobytes = 0;
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) kilobytes = std::atof(line.c_str() + 6);
  }
  return kilobytes / 1e6;
}

void BenchLargeStorey(parallel::Parallel& parallel, Figures& figures) {
  sensor::ScannerModel scanner;
  const auto model = ScannedOffice(2000, scanner, parallel);
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  const double before = PeakGigabytes();
  const double budget = 10;
  planning::Plan plan;
  const double took = WallSeconds([&] {
    plan = planning::MakePlan(*model, scanner, {}, parallel::Budget::Seconds(budget), parallel,
                              [](const planning::Plan&) {})
               .value();
  });
  const double peak = PeakGigabytes();
  const double estimate = static_cast<double>(planning::EstimatePlanningMemory(*model, {})) / 1e9;
  figures.Add({"plan.2000m2.gb", peak, "GB", "2",
               absl::StrFormat("the process at its peak while it plans %d viewcells x %d cells in "
                               "%.1f s; %.2f GB of it the model and its views; gap %.3f: %s",
                               plan.feasible_cells, plan.deficient_cells, took, before,
                               plan.optimality_gap, plan.message)});
  figures.Add({"plan.2000m2.estimate_share", (peak - before) / estimate, "of estimate", "",
               absl::StrFormat("%.2f GB taken besides the model, %.2f GB estimated beforehand",
                               peak - before, estimate)});
}

}  // namespace

void BenchPlanning(bool full, parallel::Parallel& parallel, Figures& figures) {
  if (full && (figures.Wants("plan.budget.1000m2.") || figures.Wants("plan.cancel.1000m2."))) {
    sensor::ScannerModel scanner;
    const auto model = ScannedOffice(1000, scanner, parallel);
    BenchBudgets("1000m2.", *model, scanner, 100, parallel, figures);
  }
  if (full && figures.Wants("plan.2000m2.")) BenchLargeStorey(parallel, figures);
  if (!figures.Wants("plan.embree.") && !figures.Wants("plan.brute.") &&
      !figures.Wants("plan.budget.o") && !figures.Wants("plan.cancel.p")) {
    return;
  }
  const FlatJob job = MakeFlatJob(1, 3, parallel);
  const auto view = ModelOf(job, 3, parallel)->Publish();
  BenchPackets(*view, job.scans[0].scanner, parallel, figures);
  BenchBudgets("", *view, job.scans[0].scanner, 100, parallel, figures);
}

}  // namespace vantage::bench
