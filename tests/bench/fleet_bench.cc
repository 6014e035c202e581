// Several scanners on one job: what joint plans cost, how near greedy is to the best choice, and
// what a fleet gains over one scanner (algorithm.md section 11).
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/fleet/fleet_request.h"
#include "core/fleet/joint_plan.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/fleet_job.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::bench {
namespace {

fleet::FleetRequest RequestFor(size_t count) {
  fleet::FleetRequest request;
  request.scanners.resize(count);
  return request;
}

// The gain of the greedy pair divided by that of the best of all pairs.
double GreedyOverBestPair(uint64_t seed, parallel::Parallel& parallel) {
  planning::PlanningConfig config;
  config.viewcell_size = 0.4;
  config.max_viewpoint_height = 1.7;
  config.registration.required_accuracy = 0.5;
  config.registration.minimum_overlap = 1e-6;
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(seed);
  scene.density = [](const Eigen::Vector3d& p) {
    return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
  };
  const test_support::PlanningProblem problem(
      std::make_shared<model::PlanningView>(test_support::BuildView(scene)), config);
  const fleet::JointPlan joint =
      fleet::MakeJointPlan(*problem.model, RequestFor(2), config, parallel::Budget::Unlimited(),
                           parallel, [](const planning::Plan&) {})
          .value();
  std::vector<std::vector<float>> gains;
  for (const Eigen::Vector3d& view : problem.views) {
    gains.emplace_back(problem.scoring->cells().size());
    problem.scoring->scorer().ScoreCells(view, problem.scoring->cells(),
                                         parallel::Budget::Unlimited(), gains.back());
  }
  double best = 0;
  for (size_t a = 0; a < gains.size(); ++a) {
    for (size_t b = a + 1; b < gains.size(); ++b) {
      double together = 0;
      for (size_t i = 0; i < gains[a].size(); ++i) {
        together += static_cast<double>(std::max(gains[a][i], gains[b][i]));
      }
      best = std::max(best, together);
    }
  }
  return joint.score / best;
}

void BenchGreedy(SceneUse use, parallel::Parallel& parallel, Figures& figures) {
  constexpr uint64_t kScenes = 12;
  const uint64_t first = SceneSeeds(use).front();
  double worst = 1;
  for (uint64_t seed = first; seed < first + kScenes; ++seed) {
    worst = std::min(worst, GreedyOverBestPair(seed, parallel));
  }
  figures.Add({"fleet.greedy_ratio", worst, "", ">= 0.95",
               absl::StrCat("worst of ", kScenes,
                            " furnished rooms with a station in each: greedy's pair over the best "
                            "of all pairs of views")});
}

// Both until every view is scored exactly, one thread.
void BenchCost(SceneUse use, parallel::Parallel& parallel, Figures& figures) {
  parallel::Serial serial;
  const planning::PlanningConfig config;
  std::vector<double> ratios;
  std::string by_scene;
  for (const uint64_t seed : SceneSeeds(use)) {
    const auto view = ModelOf(MakeFlatJob(seed, 3, parallel), 3, parallel)->Publish();
    const double alone = ThreadSeconds([&] {
      (void)planning::MakePlan(*view, sensor::ScannerModel(), config, parallel::Budget::Unlimited(),
                               serial, [](const planning::Plan&) {})
          .value();
    });
    fleet::JointPlan joint;
    const double together = ThreadSeconds([&] {
      joint = fleet::MakeJointPlan(*view, RequestFor(4), config, parallel::Budget::Unlimited(),
                                   serial, [](const planning::Plan&) {})
                  .value();
    });
    ratios.push_back(together / alone);
    absl::StrAppendFormat(&by_scene, "; flat-%d: %.2f s over %.2f s, %s", seed, together, alone,
                          joint.guarantee_reason);
  }
  figures.Add({"fleet.joint4.cost_ratio", Percentile(ratios, 0.5), "", "<= 1.5",
               absl::StrFormat("median of %d; CPU of a joint plan for 4 over one plan, furnished "
                               "flats after 3 scans, all views exact%s",
                               ratios.size(), by_scene)});
}

// Of all storeys: the mean of one number of their jobs, and each by itself in words.
struct OverStoreys {
  double mean = 0;
  std::string each;
};

template <typename Number>
OverStoreys Over(const std::vector<FleetJobResult>& results, Number&& number) {
  OverStoreys over;
  for (size_t i = 0; i < results.size(); ++i) {
    const double value = number(i);
    over.mean += value / static_cast<double>(results.size());
    absl::StrAppendFormat(&over.each, "%s%.3g", over.each.empty() ? "" : ", ", value);
  }
  return over;
}

// Whole jobs, simulated: the same storeys with more scanners, with and without claims.
class FleetJobs {
 public:
  FleetJobs(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures)
      : options_(options), parallel_(parallel), figures_(figures) {
    const double area = options.full ? 1000 : 250;
    std::vector<uint64_t> seeds = SceneSeeds(options.use);
    seeds.resize(std::min(seeds.size(), kStoreys));
    for (const uint64_t seed : seeds) scenes_.push_back(MakeFleetScene(seed, area, parallel));
    of_ = absl::StrFormat(
        "mean of office storeys %s of %.0f m2, to %.0f %% of what is attainable "
        "at density",
        absl::StrJoin(seeds, ", "), area, kTarget * 100);
  }

  void Run() {
    const bool speedup = figures_.Wants("fleet.speedup4");
    const bool waste = figures_.Wants("fleet.waste_ratio");
    std::vector<size_t> fleets = {1, 4};
    if (options_.full) fleets = {1, 2, 4, 8};
    std::vector<FleetJobResult> one, four;
    for (const size_t count : fleets) {
      const bool compared = count == 1 || count == 4;
      if (!figures_.Wants(absl::StrCat("fleet.job", count, ".")) &&
          !(compared && (speedup || waste))) {
        continue;
      }
      std::vector<FleetJobResult> results = RunAll(count, true);
      ReportJobs(count, results);
      if (compared) (count == 1 ? one : four) = std::move(results);
    }
    if (!four.empty() && !options_.pictures.empty()) {
      DrawTours(scenes_.front(), four.front(), options_.pictures + "/fleet-tours.svg");
    }
    if (speedup) ReportSpeedup(one, four);
    if (waste) ReportWaste(one, four, RunAll(4, false));
  }

 private:
  static constexpr double kTarget = 0.95;
  // One takes five to ten minutes, and the whole run is to stay within half an hour.
  static constexpr size_t kStoreys = 1;

  std::vector<FleetJobResult> RunAll(size_t scanners, bool claims) {
    FleetJobOptions job;
    job.target = kTarget;
    job.scanners = scanners;
    job.claims = claims;
    std::vector<FleetJobResult> results;
    for (const FleetScene& scene : scenes_) results.push_back(RunFleetJob(scene, job, parallel_));
    return results;
  }

  void ReportJobs(size_t count, const std::vector<FleetJobResult>& results) {
    const std::string prefix = absl::StrCat("fleet.job", count);
    const OverStoreys minutes = Over(results, [&](size_t i) { return results[i].minutes; });
    const OverStoreys scans =
        Over(results, [&](size_t i) { return static_cast<double>(results[i].scans); });
    const OverStoreys attained = Over(results, [&](size_t i) { return 100 * results[i].attained; });
    const OverStoreys waste = Over(results, [&](size_t i) { return results[i].waste; });
    figures_.Add({prefix + ".minutes", minutes.mean, "min", "",
                  absl::StrCat(of_, "; planning not counted; ", minutes.each)});
    figures_.Add({prefix + ".scans", scans.mean, "", "",
                  absl::StrCat(scans.each, "; attained ", attained.each, " %")});
    figures_.Add(
        {prefix + ".waste", waste.mean, "", "",
         absl::StrCat("share of what was measured at density that was so already; ", waste.each)});
  }

  void ReportSpeedup(const std::vector<FleetJobResult>& one,
                     const std::vector<FleetJobResult>& four) {
    const OverStoreys speedup =
        Over(four, [&](size_t i) { return one[i].minutes / four[i].minutes; });
    const OverStoreys alone = Over(one, [&](size_t i) { return one[i].minutes; });
    figures_.Add({"fleet.speedup4", speedup.mean, "", ">= 3.2",
                  absl::StrCat(of_, "; ", speedup.each, "; one scanner takes ", alone.each,
                               " min; planning not counted")});
  }

  // The scans of one scanner overlap, too; without that overlap none would register.
  void ReportWaste(const std::vector<FleetJobResult>& one, const std::vector<FleetJobResult>& four,
                   const std::vector<FleetJobResult>& without) {
    const auto times = [](const std::vector<FleetJobResult>& results) {
      return Over(results, [&](size_t i) { return results[i].times; });
    };
    const OverStoreys alone = times(one);
    const OverStoreys claiming = times(four);
    const OverStoreys apart = times(without);
    const OverStoreys scans =
        Over(without, [&](size_t i) { return static_cast<double>(without[i].scans); });
    const OverStoreys minutes = Over(without, [&](size_t i) { return without[i].minutes; });
    const double spared = apart.mean - alone.mean;
    if (spared <= 0) {
      absl::FPrintF(stderr, "no fleet.waste_ratio: without claims nothing was wasted either\n");
      return;
    }
    figures_.Add(
        {"fleet.waste_ratio", (claiming.mean - alone.mean) / spared, "", "<= 0.5",
         absl::StrCat(of_, "; a piece of surface is scanned at density ", alone.each,
                      " times by one scanner, ", claiming.each, " by 4, ", apart.each,
                      " by 4 without claims, which differ in seed and start, in ", scans.each,
                      " scans, ", minutes.each, " min: what is more than by one, over that")});
  }

  const BenchOptions& options_;
  parallel::Parallel& parallel_;
  Figures& figures_;
  std::vector<FleetScene> scenes_;
  std::string of_;
};

}  // namespace

void BenchFleet(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("fleet.greedy_ratio")) BenchGreedy(options.use, parallel, figures);
  if (figures.Wants("fleet.joint4.")) BenchCost(options.use, parallel, figures);
  if (figures.Wants("fleet.speedup4") || figures.Wants("fleet.waste_ratio") ||
      figures.Wants("fleet.job")) {
    FleetJobs(options, parallel, figures).Run();
  }
}

}  // namespace vantage::bench
