// What it costs to plan for a scanner that sees a sector instead of all around.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/planning_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr int kRunsOfEach = 3;
constexpr double kViewcell = 0.3;  // m: fewer views, of which each costs as much

}  // namespace

// The same model and the same views, planned to the end from prepared problems, one thread.
void BenchHeading(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("heading.")) return;
  parallel::Serial serial;
  std::vector<double> plans;
  std::vector<double> scores;
  std::string sizes;
  for (const PlanningKind& kind : {FlatsAfter(3, options.use), HallsAfter(3, options.use)}) {
    for (const PlanningScene& scene : kind.measured) {
      const std::unique_ptr<PlanningJob> job = scene.make(parallel);
      if (job == nullptr) continue;
      sensor::ScannerModel sector = job->scanner;
      sector.azimuth_span = sensor::Radians(120);
      planning::PlanningConfig config = job->config;
      config.viewcell_size = kViewcell;
      const auto all_around = planning::PlanningProblem::Prepare(
                                  {*job->model, job->scanner, config, job->problem.get()}, serial)
                                  .value();
      const auto problem = planning::PlanningProblem::Prepare(
                               {*job->model, sector, config, all_around.get()}, serial)
                               .value();
      double around = 1e9;
      double facing = 1e9;
      double score_around = 1e9;
      double score_facing = 1e9;
      std::vector<double> by_heading(problem->scoring().scorer().headings().size());
      // In turn, so that a change in the machine's speed meets both.
      for (int run = 0; run < kRunsOfEach; ++run) {
        const auto plan = [&](const planning::PlanningProblem& of) {
          return ThreadSeconds([&] {
            (void)planning::MakePlan(of, parallel::Budget::Unlimited(), serial,
                                     [](const planning::Plan&) {});
          });
        };
        around = std::min(around, plan(*all_around));
        facing = std::min(facing, plan(*problem));
        const size_t stride = std::max<size_t>(1, job->views.size() / 100);
        score_around =
            std::min(score_around, ThreadSeconds([&] {
                       for (size_t i = 0; i < job->views.size(); i += stride) {
                         (void)job->scoring->scorer().Score(job->views[i], job->scoring->cells(),
                                                            parallel::Budget::Unlimited());
                       }
                     }));
        score_facing = std::min(score_facing, ThreadSeconds([&] {
                                  for (size_t i = 0; i < job->views.size(); i += stride) {
                                    (void)problem->scoring().scorer().ScoreHeadings(
                                        job->views[i], problem->scoring().cells(),
                                        parallel::Budget::Unlimited(), by_heading);
                                  }
                                }));
      }
      plans.push_back(facing / around);
      scores.push_back(score_facing / score_around);
      sizes += absl::StrFormat("%s%s %.2f over %.2f s", sizes.empty() ? "" : ", ", scene.name,
                               facing, around);
    }
  }
  figures.Add({"heading.cost", Percentile(plans, 0.5), "of panoramic", "1.3",
               absl::StrFormat("CPU of plans to the end for 120 degrees over 360, same models and "
                               "views, best of %d, median of %d models, worst %.2f: %s",
                               kRunsOfEach, plans.size(), Percentile(plans, 1), sizes)});
  figures.Add({"heading.score_cost", Percentile(scores, 0.5), "of panoramic", "",
               "one view with all headings over the same view all around, exactly"});
}

}  // namespace vantage::bench
