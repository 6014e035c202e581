// From a scan that is all there, in memory, to ranked, checked views (algorithm.md section 2).
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/levelling.h"
#include "core/registration/registration.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {

namespace {

// s, of the plan: what its answer is worth beside every view's exact score is stated.
constexpr double kBudget = 0.12;
constexpr size_t kRuns = 6;

// What is lost by the first view of a plan beside that of one in which every view was scored
// exactly, [0, 1]. By exact scores: what the plan itself says of its view may be of a sample.
double Regret(const planning::Plan& plan, const planning::Plan& all) {
  if (plan.views.empty()) return 1;
  const Eigen::Vector3f at = plan.views[0].position.cast<float>();
  const double best = all.views.at(0).score;
  for (const planning::ScoredCell& view : all.score_map) {
    if (view.centre == at) return std::max(0.0, 1 - static_cast<double>(view.score) / best);
  }
  return 1;
}

// One run on each of the jobs in turn, kRuns in all.
void BenchAfter(size_t scans, const std::vector<ScanJob>& jobs, parallel::Parallel& parallel,
                Figures& figures) {
  const std::string prefix = absl::StrCat("cycle.flat.", scans, scans == 1 ? "scan" : "scans");
  std::vector<double> loops, total, registration, carve, merge, plan_seconds, regret;
  std::array<std::vector<double>, planning::kPlanStages> stages;
  std::vector<double> gaps;
  size_t unanswered = 0;
  std::string sizes;
  for (size_t run = 0; run < kRuns; ++run) {
    const ScanJob& job = jobs[run % jobs.size()];
    planning::Plan plan;
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
    regret.push_back(Regret(plan, all));
    unanswered += plan.views.empty() ? 1 : 0;
    gaps.push_back(plan.optimality_gap);
    for (size_t stage = 0; stage < stages.size(); ++stage) {
      stages[stage].push_back(plan.seconds[stage]);
    }
    if (run < jobs.size()) {
      absl::StrAppendFormat(&sizes, "%s%d viewcells x %d cells", sizes.empty() ? "" : ", ",
                            plan.feasible_cells, plan.deficient_cells);
    }
    registration.push_back(align);
    carve.push_back(report.carve_seconds);
    merge.push_back(report.merge_seconds);
    plan_seconds.push_back(planning);
    total.push_back(align + insert + planning);
  }
  const std::string of =
      absl::StrFormat("median of %d in %d flats; %d samples a scan, plan budget %g s", kRuns,
                      jobs.size(), jobs[0].scans[0].image.SampleCount(), kBudget);
  figures.Add({prefix + ".seconds", Percentile(total, 0.5), "s", scans == 3 ? "0.4" : "",
               absl::StrFormat("%s; a loop of 1e8 multiply-adds took %.3f s beside it", of,
                               Percentile(loops, 0.5))});
  figures.Add({prefix + ".registration.seconds", Percentile(registration, 0.5), "s", "", of});
  figures.Add({prefix + ".carve.seconds", Percentile(carve, 0.5), "s", "", of});
  figures.Add({prefix + ".merge.seconds", Percentile(merge, 0.5), "s", "", of});
  figures.Add({prefix + ".plan.seconds", Percentile(plan_seconds, 0.5), "s", "", of});
  figures.Add({prefix + ".plan.regret", 100 * Percentile(regret, 1), "%", "",
               absl::StrFormat("worst of %d, beside plans without a limit; %d gave no view, which "
                               "counts as 100 %%",
                               kRuns, unanswered)});
  for (size_t stage = 0; stage < stages.size(); ++stage) {
    std::string name = planning::kPlanStageNames[stage];
    for (char& c : name) c = c == ' ' ? '_' : c;
    figures.Add({absl::StrCat(prefix, ".plan.", name, ".seconds"), Percentile(stages[stage], 0.5),
                 "s", "", of});
  }
  figures.Add({prefix + ".plan.gap", Percentile(gaps, 0.5), "", "",
               absl::StrCat("median of ", kRuns, "; ", sizes)});
}

}  // namespace

void BenchCycle(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("cycle.")) return;
  std::vector<ScanJob> jobs;
  for (const uint64_t seed : SceneSeeds(options.use)) {
    jobs.push_back(MakeFlatJob(seed, 3, parallel));
  }
  BenchAfter(1, jobs, parallel, figures);
  BenchAfter(3, jobs, parallel, figures);
}

}  // namespace vantage::bench
