// What the planner answers at a budget: against the tuned rival, and against brute force.
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/anytime.h"
#include "tests/bench/answer_judge.h"
#include "tests/bench/anytime_curves.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/cpu_budget.h"
#include "tests/bench/planning_job.h"
#include "tests/bench/rival_planner.h"

namespace vantage::bench {
namespace {

constexpr uint64_t kTuningSeed = 100'001;  // the rival is tuned on other seeds than it is judged on
constexpr double kEnough = 0.005;          // regret

planning::Evaluation Ours(const PlanningJob& job, uint64_t seed, const parallel::Budget& budget) {
  parallel::Serial serial;
  return AnytimeEvaluation(job, seed, budget, serial);
}

// `evaluate(seed)` for seeds from `first` on, one to a thread at a time, each counting its own CPU.
template <typename Evaluate>
std::vector<double> Regrets(const AnswerJudge& judge, uint64_t first, int runs,
                            parallel::Parallel& parallel, Evaluate&& evaluate) {
  std::vector<double> regrets(static_cast<size_t>(runs));
  parallel.For(regrets.size(), [&](size_t k) { regrets[k] = judge.Regret(evaluate(first + k)); });
  return regrets;
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Points (scene and budget) at which the planner is no worse than the rival.
struct Points {
  int all = 0;
  int no_worse = 0;
};

Points Duel(const std::string& scene, const PlanningJob& job, const AnswerJudge& judge,
            parallel::Parallel& parallel, Figures& figures) {
  Points points;
  std::string table;
  for (const double milliseconds : {10, 30, 100, 300, 1000}) {
    const double seconds = 1e-3 * milliseconds;
    const bool brief = milliseconds <= 100;
    const int runs = brief ? 40 : 12;
    const int tuning = brief ? 6 : 2;
    RivalSettings tuned;
    double least = 2;
    for (const RivalSettings& choice : RivalChoices()) {
      const double mean = Mean(Regrets(judge, kTuningSeed, tuning, parallel, [&](uint64_t seed) {
        return RivalEvaluation(job, choice, seed, CpuBudget(seconds));
      }));
      if (mean >= least) continue;
      least = mean;
      tuned = choice;
    }
    const double rival = Percentile(
        Regrets(
            judge, 1, runs, parallel,
            [&](uint64_t seed) { return RivalEvaluation(job, tuned, seed, CpuBudget(seconds)); }),
        0.95);
    const std::vector<double> own = Regrets(judge, 1, runs, parallel, [&](uint64_t seed) {
      return Ours(job, seed, CpuBudget(seconds));
    });
    const double ours = Percentile(own, 0.95);
    ++points.all;
    points.no_worse += ours <= rival + 1e-9;
    absl::StrAppendFormat(&table, "%s%g ms: %.2f %% against %.2f %% (lattice %d, %d draws)",
                          table.empty() ? "" : "; ", milliseconds, 100 * ours, 100 * rival,
                          tuned.stride, tuned.draws);
  }
  figures.Add(
      {absl::StrCat("plan.anytime.dominates.", scene),
       static_cast<double>(points.no_worse) / points.all, "of points", "1",
       absl::StrCat("95th-percentile regret at CPU budgets, ours against the rival's: ", table)});
  return points;
}

// The shortest budget, as a part of brute force's time, at which every plan is good enough.
void Speedup(const std::string& scene, const PlanningJob& job, const AnswerJudge& judge, int runs,
             std::span<const double> parts, const std::string& aim, parallel::Parallel& parallel,
             Figures& figures) {
  std::string tried;
  for (const double part : parts) {
    const double seconds = judge.brute_seconds() / part;
    std::vector<double> regrets;
    // A few first: most parts that fail do so at once.
    for (const int count : {runs / 10, runs}) {
      regrets = Regrets(judge, 1, count, parallel,
                        [&](uint64_t seed) { return Ours(job, seed, CpuBudget(seconds)); });
      if (Percentile(regrets, 1) > kEnough) break;
    }
    const double worst = Percentile(regrets, 1);
    if (worst > kEnough) {
      absl::StrAppendFormat(&tried, "; %g times: worst %.2f %% of %d", part, 100 * worst,
                            regrets.size());
      continue;
    }
    figures.Add(
        {absl::StrCat("plan.anytime.speedup.", scene), part, "times", aim,
         absl::StrFormat("less CPU than brute force (%.1f s) for a regret of at most 0.5 %% "
                         "in %d of %d plans; %s%s",
                         judge.brute_seconds(), runs, runs, job.Size(), tried)});
    figures.Add({absl::StrCat("plan.anytime.worst_regret.", scene), 100 * worst, "%", "0.5",
                 absl::StrFormat("of those plans, at %.3f s", seconds)});
    figures.Add({absl::StrCat("plan.anytime.cpu_seconds.", scene), seconds, "s",
                 scene == "1000m2" ? "1" : "", "of one thread for such a plan"});
    return;
  }
  figures.Add({absl::StrCat("plan.anytime.speedup.", scene), 0, "times", aim,
               absl::StrCat("none found", tried)});
}

// Two threads against one, on the same work, beside a loop of plain arithmetic.
void BenchThreads(const PlanningJob& job, Figures& figures) {
  parallel::Serial serial;
  parallel::ThreadPool pool(2);
  parallel::Budget budget;
  budget.work_limit = 10'000'000;
  const auto evaluate = [&](parallel::Parallel& parallel) {
    return WallSeconds([&] {
      (void)planning::EvaluateViews(job.scoring->scorer(), job.feasible, job.scoring->cells(),
                                    job.grid, {}, budget, parallel,
                                    [](const planning::Evaluation&) {});
    });
  };
  volatile double factor = 0.999999;  // not to be known when this is compiled
  volatile double sink = 0;
  const auto loop = [&](parallel::Parallel& parallel) {
    return WallSeconds([&] {
      parallel.For(16, [&](size_t) {
        const double by = factor;
        double x = 1;
        for (int i = 0; i < 10'000'000; ++i) x = x * by + 1e-6;
        sink = x;
      });
    });
  };
  std::vector<double> ours, plain;
  for (int run = 0; run < 7; ++run) {  // in turn: what else the machine does meets both
    ours.push_back(evaluate(serial) / evaluate(pool));
    plain.push_back(loop(serial) / loop(pool));
  }
  const double own = Percentile(ours, 0.5);
  const double loops = Percentile(plain, 0.5);
  figures.Add({"plan.threads2.speedup", own / loops, "of a loop's", "0.95",
               absl::StrFormat("evaluating views on 2 threads: %.2f times as fast as on 1; plain "
                               "arithmetic %.2f times; medians of 7",
                               own, loops)});
}

constexpr double kFlatParts[] = {800, 600, 400, 300, 200, 150, 100, 80,
                                 65,  50,  40,  30,  20,  15,  10,  5};
constexpr double kStoreyParts[] = {4000, 2800, 2000, 1400, 1000, 700, 500, 400, 300, 200, 100, 50};

}  // namespace

void BenchAnytime(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const bool full = options.full;
  Points points;
  const auto wanted = [&](const std::string& scene) {
    return figures.Wants(absl::StrCat("plan.anytime.dominates.", scene)) ||
           figures.Wants(absl::StrCat("plan.anytime.speedup.", scene)) ||
           figures.Wants(absl::StrCat("plan.anytime.worst_regret.", scene)) ||
           figures.Wants(absl::StrCat("plan.anytime.cpu_seconds.", scene)) ||
           (!options.pictures.empty() && figures.Wants(absl::StrCat("plan.anytime.curve.", scene)));
  };
  const auto bench = [&](const std::string& scene, std::unique_ptr<PlanningJob> job, int runs,
                         std::span<const double> parts, const std::string& aim) {
    const AnswerJudge judge(*job, parallel);
    if (figures.Wants(absl::StrCat("plan.anytime.dominates.", scene))) {
      const Points own = Duel(scene, *job, judge, parallel, figures);
      points.all += own.all;
      points.no_worse += own.no_worse;
    }
    if (!options.pictures.empty()) {
      const std::string path = absl::StrCat(options.pictures, "/anytime-", scene, ".svg");
      if (!DrawAnytimeCurves(path, scene, *job, judge, parallel)) {
        absl::FPrintF(stderr, "cannot write %s\n", path);
      }
    }
    if (parts.empty() || !figures.Wants("plan.anytime.")) return;
    if (!figures.Wants(absl::StrCat("plan.anytime.speedup.", scene)) &&
        !figures.Wants(absl::StrCat("plan.anytime.worst_regret.", scene)) &&
        !figures.Wants(absl::StrCat("plan.anytime.cpu_seconds.", scene))) {
      return;
    }
    Speedup(scene, *job, judge, full ? 200 : runs, parts, aim, parallel, figures);
  };
  if (wanted("flat1")) bench("flat1", FlatPlanningJob(1, parallel), 0, {}, "");
  if (wanted("flat3")) bench("flat3", FlatPlanningJob(3, parallel), 200, kFlatParts, "50");
  if (wanted("small_house")) {
    if (auto job = SmallHousePlanningJob(parallel)) {
      bench("small_house", std::move(job), 40, kFlatParts, "");
    }
  }
  if (wanted("250m2")) {
    bench("250m2", OfficePlanningJob(250, parallel), 40, kStoreyParts, "");
  }
  if (full && wanted("1000m2")) {
    bench("1000m2", OfficePlanningJob(1000, parallel), 40, kStoreyParts, "400");
  }
  if (points.all > 0) {
    figures.Add({"plan.anytime.dominates",
                 static_cast<double>(points.no_worse) / static_cast<double>(points.all),
                 "of points", "1",
                 absl::StrCat(points.no_worse, " of ", points.all,
                              " points (scenes x budgets) at which our 95th-percentile regret is "
                              "no worse than that of the rival, tuned for each")});
  }
  if (figures.Wants("plan.threads2.")) BenchThreads(*FlatPlanningJob(3, parallel), figures);
}

}  // namespace vantage::bench
