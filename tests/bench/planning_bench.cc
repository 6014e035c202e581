// Compares the brute-force scorer with Embree's own rate of rays, and measures whether budgets are
// kept.

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

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
#include "tests/bench/planning_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

constexpr size_t kPacketViews = 130;  // of each model, that rays are traced from

// M rays / s on the same rays, one thread.
struct PacketRates {
  double embree = 0;  // packets of 8 alone
  double brute = 0;   // the scorer
  uint64_t rays = 0;
  uint32_t checksum = 0;
};

PacketRates MeasurePackets(const PlanningJob& job) {
  const parallel::Budget unlimited = parallel::Budget::Unlimited();
  const planning::Scoring& scoring = *job.scoring;
  const planning::FeasibleViews& feasible = job.feasible;
  const planning::SensingConstraints constraints(job.scanner);
  const planning::CellArrays& cells = scoring.cells();

  // Some 130 views; their packets are laid out beforehand for Embree alone.
  struct Packets {
    Eigen::Vector3f origin;
    std::vector<std::pair<visibility::TargetPacket, uint32_t>> packets;
  };
  std::vector<Eigen::Vector3d> views;
  std::vector<Packets> raw;
  uint64_t raw_rays = 0;
  const size_t stride = std::max<size_t>(1, feasible.cells().size() / kPacketViews);
  for (size_t i = 0; i < feasible.cells().size(); i += stride) {
    views.push_back(feasible.Centre(i));
    Packets of_view{scoring.scene().ToScene(views.back() / job.model->voxel_size()), {}};
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
  return {1e-6 * static_cast<double>(raw_rays) / raw_best,
          1e-6 * static_cast<double>(rays) / brute_best, rays, sink % 97};
}

void BenchPackets(std::span<const std::unique_ptr<PlanningJob>> jobs, Figures& figures) {
  std::vector<double> embree, brute, shares;
  uint64_t rays = 0;
  uint32_t checksum = 0;
  for (const auto& job : jobs) {
    const PacketRates rates = MeasurePackets(*job);
    embree.push_back(rates.embree);
    brute.push_back(rates.brute);
    shares.push_back(rates.brute / rates.embree);
    rays += rates.rays;
    checksum += rates.checksum;
  }
  const auto of = [](const std::vector<double>& values) {
    return absl::StrFormat("median of %d models, %.3g to %.3g", values.size(),
                           Percentile(values, 0), Percentile(values, 1));
  };
  figures.Add(
      {"plan.embree.rays_per_second", Percentile(embree, 0.5), "M rays/s", "",
       absl::StrFormat("packets of 8 alone, one thread, best of 5; %d rays, checksum %d; %s", rays,
                       checksum, of(embree))});
  figures.Add({"plan.brute.rays_per_second", Percentile(brute, 0.5), "M rays/s", "",
               absl::StrCat("the scorer on the same rays, cheap tests included; ", of(brute))});
  figures.Add({"plan.brute.packet_share", Percentile(shares, 0.5), "of raw", "0.7",
               absl::StrCat("the scorer's rate over Embree's on the same rays; ", of(shares))});
}

// `of`: the kind's part of the figures' names. Plans of all models in turn.
void BenchBudgets(const std::string& of, std::span<const std::unique_ptr<PlanningJob>> jobs,
                  int runs, parallel::Parallel& parallel, Figures& figures) {
  std::vector<double> over, cancelled;
  const auto nobody = [](const planning::Plan&) {};
  for (int run = 0; run < runs; ++run) {
    const PlanningJob& job = *jobs[static_cast<size_t>(run) % jobs.size()];
    const double budget = run / static_cast<int>(jobs.size()) % 2 == 0 ? 0.05 : 0.2;
    const double took = WallSeconds([&] {
      (void)planning::MakePlan(*job.model, job.scanner, {}, parallel::Budget::Seconds(budget),
                               parallel, nobody);
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
    (void)planning::MakePlan(*job.model, job.scanner, {}, endless, parallel, nobody);
    const auto ended = std::chrono::steady_clock::now();
    canceller.join();
    // A plan that was complete before it was cancelled says nothing.
    if (ended > asked) {
      cancelled.push_back(std::chrono::duration<double>(ended - asked).count());
    }
  }
  figures.Add({absl::StrCat("plan.budget.", of, "over_p99"), 1e3 * Percentile(over, 0.99), "ms",
               "20",
               absl::StrFormat("time past budgets of 50 and 200 ms, %d plans of %d models; median "
                               "%.1f ms, most %.1f",
                               over.size(), jobs.size(), 1e3 * Percentile(over, 0.5),
                               1e3 * Percentile(over, 1))});
  if (cancelled.empty()) return;
  figures.Add({absl::StrCat("plan.cancel.", of, "p99"), 1e3 * Percentile(cancelled, 0.99), "ms",
               "50",
               absl::StrFormat("from the request to the end, %d plans of %d models; median %.1f "
                               "ms, most %.1f",
                               cancelled.size(), jobs.size(), 1e3 * Percentile(cancelled, 0.5),
                               1e3 * Percentile(cancelled, 1))});
}

void BenchLargeStorey(uint64_t seed, parallel::Parallel& parallel, Figures& figures) {
  sensor::ScannerModel scanner;
  const auto model = ScannedOffice(seed, 2000, scanner, parallel);
  test_support::ResetPeak();
  const double before = test_support::ResidentMegabytes() / 1e3;
  const double budget = 10;
  planning::Plan plan;
  const double took = WallSeconds([&] {
    plan = planning::MakePlan(*model, scanner, {}, parallel::Budget::Seconds(budget), parallel,
                              [](const planning::Plan&) {})
               .value();
  });
  const double peak = test_support::PeakMegabytes() / 1e3;
  const double estimate =
      static_cast<double>(
          planning::PlanningSize(*model, {}).Bytes(static_cast<double>(plan.feasible_cells))) /
      1e9;
  figures.Add({"plan.2000m2.gb", peak, "GB", "2",
               absl::StrFormat(
                   "one scene: the process at its peak while it plans %d viewcells x %d cells in "
                   "%.1f s; %.2f GB of it the model and its views; gap %.3f: %s",
                   plan.feasible_cells, plan.deficient_cells, took, before, plan.optimality_gap,
                   plan.message)});
  figures.Add({"plan.2000m2.estimate_share", (peak - before) / estimate, "of estimate", "",
               absl::StrFormat("one scene: %.2f GB taken besides the model, %.2f GB estimated",
                               peak - before, estimate)});
}

}  // namespace

void BenchPlanning(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const auto jobs_of = [&](const std::vector<PlanningKind>& kinds) {
    std::vector<std::unique_ptr<PlanningJob>> jobs;
    for (const PlanningKind& kind : kinds) {
      for (const PlanningScene& scene : kind.measured) jobs.push_back(scene.make(parallel));
    }
    return jobs;
  };
  if (options.full &&
      (figures.Wants("plan.budget.1000m2.") || figures.Wants("plan.cancel.1000m2."))) {
    BenchBudgets("1000m2.", jobs_of({OfficeStoreys(1000, options.use)}), 102, parallel, figures);
  }
  if (options.full && figures.Wants("plan.2000m2.")) {
    BenchLargeStorey(SceneSeeds(options.use).front(), parallel, figures);
  }
  const bool packets = figures.Wants("plan.embree.") || figures.Wants("plan.brute.");
  const bool budgets = figures.Wants("plan.budget.over_p99") || figures.Wants("plan.cancel.p99");
  if (!packets && !budgets) return;
  const auto jobs = jobs_of(
      {FlatsAfter(3, options.use), HallsAfter(3, options.use), OfficeStoreys(250, options.use)});
  if (packets) BenchPackets(jobs, figures);
  if (budgets) BenchBudgets("", jobs, 108, parallel, figures);
}

}  // namespace vantage::bench
