#include "tests/bench/anytime_curves.h"

#include <algorithm>
#include <array>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/evaluation/patch_order.h"
#include "tests/bench/cpu_budget.h"
#include "tests/bench/curve_chart.h"
#include "tests/bench/figures.h"
#include "tests/bench/rival_planner.h"

namespace vantage::bench {
namespace {

constexpr size_t kSeeds = 7;         // up to kMostRepeated
constexpr double kMostRepeated = 1;  // s
constexpr double kLongest = 20;      // s, of CPU: brute force itself takes minutes on storeys
constexpr double kLeast = 1e-4;      // regret drawn as 0

// The optimality gap that the plan would state; no view is refused here.
double Gap(const planning::Evaluation& evaluation) {
  double most = 0;
  double lower = 0;
  double rank = -1;
  for (const planning::ViewEstimate& view : evaluation.views) {
    most = std::max(most, view.upper);
    if (view.scored && view.Rank() > rank) {
      rank = view.Rank();
      lower = view.lower;
    }
  }
  return most > 0 && rank >= 0 ? 1 - lower / most : 1;
}

}  // namespace

planning::Evaluation AnytimeEvaluation(const PlanningJob& job, uint64_t seed,
                                       const parallel::Budget& budget,
                                       parallel::Parallel& parallel) {
  planning::AnytimeOptions options;
  options.seed = seed;
  options.separation = job.config.candidate_separation;
  options.leaders = job.config.candidates;
  return planning::EvaluateViews(job.scoring->scorer(), job.feasible, job.scoring->cells(),
                                 job.grid, options, budget, parallel,
                                 [](const planning::Evaluation&) {});
}

bool DrawAnytimeCurves(const std::string& path, const std::string& scene, const PlanningJob& job,
                       const AnswerJudge& judge, parallel::Parallel& parallel) {
  const double longest = std::min(judge.brute_seconds() * 1.1, kLongest + 1e-9);
  std::vector<double> times;
  for (double decade = 0.005; decade < longest; decade *= 10) {
    for (const double step : {1.0, 2.0, 4.0, 6.0}) {
      if (decade * step <= longest) times.push_back(decade * step);
    }
  }
  ChartCurve median{"race, decide, complete: median", "#1f6fb4", false, {}};
  ChartCurve worst{"worst of 7 seeds (to 1 s)", "#1f6fb4", true, {}};
  ChartCurve rival{"lattice, sample, refine", "#d07a1f", false, {}};
  ChartCurve patches{"the paper's patch order", "#3a8f3a", false, {}};
  ChartCurve gap{"race, decide, complete", "#1f6fb4", false, {}};
  ChartCurve patch_gap{"the paper's patch order", "#3a8f3a", false, {}};
  for (const double time : times) {
    const size_t seeds = time <= kMostRepeated ? kSeeds : 1;
    std::vector<double> own(seeds), gaps(seeds), theirs(seeds);
    std::array<double, 2> by_patch{};
    // Each run on one thread, which counts its own time.
    parallel.For(2 * seeds + 1, [&](size_t k) {
      parallel::Serial serial;
      const parallel::Budget budget = CpuBudget(time);
      if (k == 2 * seeds) {
        const planning::Evaluation evaluation = planning::EvaluateByPatches(
            job.scoring->scorer(), job.feasible, job.scoring->cells(), job.patches, job.grid, {},
            budget, serial, [](const planning::Evaluation&) {});
        by_patch = {judge.Regret(evaluation), Gap(evaluation)};
      } else if (k < seeds) {
        const planning::Evaluation evaluation = AnytimeEvaluation(job, k + 1, budget, serial);
        own[k] = judge.Regret(evaluation);
        gaps[k] = Gap(evaluation);
      } else {
        theirs[k - seeds] = judge.Regret(RivalEvaluation(job, {}, k, budget));
      }
    });
    median.points.emplace_back(time, Percentile(own, 0.5));
    if (seeds > 1) worst.points.emplace_back(time, Percentile(own, 1));
    rival.points.emplace_back(time, Percentile(theirs, 0.5));
    patches.points.emplace_back(time, by_patch[0]);
    gap.points.emplace_back(time, Percentile(gaps, 0.5));
    patch_gap.points.emplace_back(time, by_patch[1]);
  }
  const ChartPanel regret{"regret of the answer, after registration check and separation",
                          true,
                          kLeast,
                          1,
                          {1e-4, 1e-3, 0.005, 0.01, 0.1, 1},
                          {median, worst, rival, patches}};
  const ChartPanel stated{"optimality gap as stated", false,           0, 1,
                          {0, 0.25, 0.5, 0.75, 1},    {gap, patch_gap}};
  return WriteChart(path, absl::StrCat(scene, ": ", job.Size()), times.front(), times.back(),
                    {regret, stated});
}

}  // namespace vantage::bench
