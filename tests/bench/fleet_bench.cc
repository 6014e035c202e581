// Several scanners on one job: what joint plans cost, how near greedy is to the best choice, and
// what a fleet gains over one scanner (algorithm.md section 11).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/fleet/fleet_request.h"
#include "core/fleet/joint_plan.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/flat_job.h"
#include "tests/bench/fleet_job.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::bench {
namespace {

fleet::FleetRequest RequestFor(size_t count) {
  fleet::FleetRequest request;
  request.scanners.resize(count);
  return request;
}

// What greedy's pair gains together over what the best of all pairs does.
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

void BenchGreedy(parallel::Parallel& parallel, Figures& figures) {
  constexpr uint64_t kScenes = 12;
  double worst = 1;
  for (uint64_t seed = 1; seed <= kScenes; ++seed) {
    worst = std::min(worst, GreedyOverBestPair(seed, parallel));
  }
  figures.Add({"fleet.greedy_ratio", worst, "", ">= 0.95",
               absl::StrCat("worst of ", kScenes,
                            " furnished rooms with a station in each: greedy's pair over the best "
                            "of all pairs of views")});
}

// Both until every view is scored exactly, one thread.
void BenchCost(parallel::Parallel& parallel, Figures& figures) {
  const FlatJob job = MakeFlatJob(1, 3, parallel);
  const auto view = ModelOf(job, 3, parallel)->Publish();
  parallel::Serial serial;
  const planning::PlanningConfig config;
  std::vector<double> ratios;
  double alone = 0;
  double together = 0;
  fleet::JointPlan joint;
  for (int run = 0; run < 3; ++run) {
    alone = ThreadSeconds([&] {
      (void)planning::MakePlan(*view, sensor::ScannerModel(), config, parallel::Budget::Unlimited(),
                               serial, [](const planning::Plan&) {})
          .value();
    });
    together = ThreadSeconds([&] {
      joint = fleet::MakeJointPlan(*view, RequestFor(4), config, parallel::Budget::Unlimited(),
                                   serial, [](const planning::Plan&) {})
                  .value();
    });
    ratios.push_back(together / alone);
  }
  figures.Add({"fleet.joint4.cost_ratio", Percentile(ratios, 0.5), "", "<= 1.5",
               absl::StrFormat("median of 3; CPU of a joint plan for 4 (%.2f s) over one plan "
                               "(%.2f s), furnished flat after 3 scans, all views exact; %s",
                               together, alone, joint.guarantee_reason)});
}

// Whole jobs, simulated: the same storey with more scanners, with and without claims.
void BenchJobs(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const double area = options.full ? 1000 : 250;
  const FleetScene scene = MakeFleetScene(1, area, parallel);
  FleetJobOptions job;
  job.target = 0.95;
  std::vector<size_t> fleets = {1, 4};
  if (options.full) fleets = {1, 2, 4, 8};
  FleetJobResult one;
  const std::string of =
      absl::StrFormat("office storey of %.0f m2, to %.0f %% of what is attainable at density", area,
                      job.target * 100);
  for (const size_t count : fleets) {
    job.scanners = count;
    job.claims = true;
    const FleetJobResult with = RunFleetJob(scene, job, parallel);
    const std::string prefix = absl::StrCat("fleet.job", count);
    figures.Add({prefix + ".minutes", with.minutes, "min", "", of});
    figures.Add({prefix + ".scans", static_cast<double>(with.scans), "", "",
                 absl::StrFormat("%.1f %% attained", with.attained * 100)});
    figures.Add({prefix + ".waste", with.waste, "", "",
                 "share of what was measured at density that was so already"});
    if (count == 1) one = with;
    if (count == 4) {
      figures.Add({"fleet.speedup4", one.minutes / with.minutes, "", ">= 3.2",
                   absl::StrFormat("%s; one scanner takes %.0f min", of, one.minutes)});
      job.claims = false;
      const FleetJobResult without = RunFleetJob(scene, job, parallel);
      // One scanner's scans overlap as well: so much is needed, or nothing would register.
      const double spared = without.times - one.times;
      figures.Add(
          {"fleet.waste_ratio", spared > 0 ? (with.times - one.times) / spared : 0, "", "<= 0.5",
           absl::StrFormat(
               "%s; a piece of surface is scanned at density %.2f times by one scanner, %.2f by 4, "
               "%.2f by 4 without claims, in %d scans, %.0f min: what is more than by one, over "
               "that",
               of, one.times, with.times, without.times, without.scans, without.minutes)});
      if (!options.pictures.empty()) DrawTours(scene, with, options.pictures + "/fleet-tours.svg");
    }
  }
}

}  // namespace

void BenchFleet(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("fleet.greedy_ratio")) BenchGreedy(parallel, figures);
  if (figures.Wants("fleet.joint4.")) BenchCost(parallel, figures);
  if (figures.Wants("fleet.speedup4") || figures.Wants("fleet.waste_ratio") ||
      figures.Wants("fleet.job")) {
    BenchJobs(options, parallel, figures);
  }
}

}  // namespace vantage::bench
