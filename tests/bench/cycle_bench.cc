// From the last sample in the server to ranked, checked views (algorithm.md section 2).
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/levelling.h"
#include "core/registration/registration.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/flat_job.h"

namespace vantage::bench {

namespace {

// s, of the plan: what its answer is worth beside every view's exact score is stated.
constexpr double kBudget = 0.12;

void BenchAfter(size_t scans, const FlatJob& job, parallel::Parallel& parallel, Figures& figures) {
  const std::string prefix = absl::StrCat("cycle.flat.", scans, scans == 1 ? "scan" : "scans");
  std::vector<double> loops, total, registration, carve, merge, plan_seconds, regret;
  planning::Plan plan;
  for (int run = 0; run < 5; ++run) {
    const auto model = ModelOf(job, scans - 1, parallel);
    loops.push_back(MachineLoopSeconds());
    registration::RegistrationResult result;
    double align = 0;
    if (scans > 1) {
      sensor::PosePrior prior;
      prior.T_world_scan = job.poses[scans - 1];
      prior.T_world_scan.pretranslate(Eigen::Vector3d(0.05, -0.04, 0.02));
      prior.T_world_scan.rotate(Eigen::AngleAxisd(sensor::Radians(2), Eigen::Vector3d::UnitZ()));
      align = WallSeconds([&] {
        result =
            registration::Register(*model->Publish(), job.scans[scans - 1], prior, {}, parallel)
                .value();
      });
    } else {
      align = WallSeconds([&] { (void)registration::LevelFirstScan(job.scans[0]).value(); });
      result.T_world_scan = job.poses[0];
    }
    model::MergeReport report;
    const double insert = WallSeconds([&] {
      report = model->Insert("last", job.scans[scans - 1], result.T_world_scan, parallel).value();
    });
    const double planning = WallSeconds([&] {
      plan = planning::MakePlan(*model->Publish(), job.scans[0].scanner, {},
                                parallel::Budget::Seconds(kBudget), parallel,
                                [](const planning::Plan&) {})
                 .value();
    });
    const planning::Plan all =
        planning::MakePlan(*model->Publish(), job.scans[0].scanner, {},
                           parallel::Budget::Unlimited(), parallel, [](const planning::Plan&) {})
            .value();
    const double best = all.views.at(0).score;
    regret.push_back(plan.views.empty() ? 1 : (best - plan.views[0].score) / best);
    registration.push_back(align);
    carve.push_back(report.carve_seconds);
    merge.push_back(report.merge_seconds);
    plan_seconds.push_back(planning);
    total.push_back(align + insert + planning);
  }
  const std::string of = absl::StrCat("median of 5; ", job.scans[0].image.SampleCount(),
                                      " samples a scan, plan budget ", kBudget, " s");
  figures.Add({prefix + ".seconds", Percentile(total, 0.5), "s", scans == 3 ? "0.4" : "",
               absl::StrFormat("%s; a loop of 1e8 multiply-adds took %.3f s beside it", of,
                               Percentile(loops, 0.5))});
  figures.Add({prefix + ".registration.seconds", Percentile(registration, 0.5), "s", "", of});
  figures.Add({prefix + ".carve.seconds", Percentile(carve, 0.5), "s", "", of});
  figures.Add({prefix + ".merge.seconds", Percentile(merge, 0.5), "s", "", of});
  figures.Add({prefix + ".plan.seconds", Percentile(plan_seconds, 0.5), "s", "", of});
  figures.Add({prefix + ".plan.regret", 100 * Percentile(regret, 1), "%", "",
               "worst of 5, beside plans without a limit"});
  for (int stage = 0; stage < planning::kPlanStages; ++stage) {
    std::string name = planning::kPlanStageNames[static_cast<size_t>(stage)];
    for (char& c : name) c = c == ' ' ? '_' : c;
    figures.Add({absl::StrCat(prefix, ".plan.", name, ".seconds"),
                 plan.seconds[static_cast<size_t>(stage)], "s", "", "last run"});
  }
  figures.Add({prefix + ".plan.gap", plan.optimality_gap, "", "",
               absl::StrCat(plan.feasible_cells, " viewcells x ", plan.deficient_cells, " cells")});
}

}  // namespace

void BenchCycle(parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("cycle.")) return;
  const FlatJob job = MakeFlatJob(1, 3, parallel);
  BenchAfter(1, job, parallel, figures);
  BenchAfter(3, job, parallel, figures);
}

}  // namespace vantage::bench
