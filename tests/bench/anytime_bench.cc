// The planner's answers at budgets, compared with the tuned rival and with brute force.
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "tests/bench/answer_judge.h"
#include "tests/bench/anytime_curves.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/cpu_budget.h"
#include "tests/bench/planning_job.h"
#include "tests/bench/rival_planner.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr uint64_t kTuningSeed = 100'001;  // the rival is tuned on seeds that it is not judged on
constexpr double kEnough = 0.005;          // regret
constexpr std::array<double, 5> kBudgets = {0.01, 0.03, 0.1, 0.3, 1};  // s of CPU, one thread
constexpr double kBrief = 0.1;  // s, up to which runs cost little, so that there are more

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

// For each budget the settings with which the rival does best in the mean on `scene`. Empty: the
// scene's file is not there.
std::vector<RivalSettings> TuneRival(const PlanningScene& scene, parallel::Parallel& parallel) {
  const std::unique_ptr<PlanningJob> job = scene.make(parallel);
  if (job == nullptr) return {};
  const AnswerJudge judge(*job, parallel);
  std::vector<RivalSettings> tuned;
  for (const double seconds : kBudgets) {
    RivalSettings best;
    double least = 2;
    for (const RivalSettings& choice : RivalChoices()) {
      const double mean =
          Mean(Regrets(judge, kTuningSeed, seconds <= kBrief ? 6 : 2, parallel, [&](uint64_t seed) {
            return RivalEvaluation(*job, choice, seed, CpuBudget(seconds));
          }));
      if (mean >= least) continue;
      least = mean;
      best = choice;
    }
    tuned.push_back(best);
  }
  return tuned;
}

// 95th percentiles of regret at one budget on one scene.
struct Duel {
  double ours = 0;
  double rivals = 0;
};

// By budget. Both on the same seeds, in turn: a change in the machine's speed meets both.
std::vector<Duel> DuelOn(const PlanningJob& job, const AnswerJudge& judge,
                         std::span<const RivalSettings> tuned, parallel::Parallel& parallel) {
  std::vector<Duel> duels;
  for (size_t b = 0; b < kBudgets.size(); ++b) {
    const double seconds = kBudgets[b];
    const int runs = seconds <= kBrief ? 20 : 10;
    const std::vector<double> rivals = Regrets(judge, 1, runs, parallel, [&](uint64_t seed) {
      return RivalEvaluation(job, tuned[b], seed, CpuBudget(seconds));
    });
    const std::vector<double> ours = Regrets(judge, 1, runs, parallel, [&](uint64_t seed) {
      return Ours(job, seed, CpuBudget(seconds));
    });
    duels.push_back({Percentile(ours, 0.95), Percentile(rivals, 0.95)});
  }
  return duels;
}

// The shortest step D, as a part of brute force's time, after which every answer is good enough.
struct Fastest {
  double part = 0;        // 0: none was found
  double brute = 0;       // s, all views by brute force
  double seconds = 0;     // of step D
  double worst = 0;       // regret
  std::string tried;      // what failed
  double plan = 0;        // s, CPU of whole plans, steps A to F, that are all as good; 0: none are
  double plan_worst = 0;  // their regret
};

// CPU of steps A to C and of what step D has to build, one thread.
double PreparationSeconds(const PlanningJob& job) {
  parallel::Serial serial;
  return ThreadSeconds([&] { (void)PlanningJob(job.model, job.scanner, serial); });
}

// The cheapest whole plans that are good enough: budgets from what leaves step D `result.seconds`
// on, until registration of the first view is checked in time as well.
void MeasureWholePlans(const PlanningJob& job, const AnswerJudge& judge,
                       parallel::Parallel& parallel, Fastest& result) {
  constexpr size_t kPlans = 10;
  // MakePlan keeps a fifth of what is left before step D for what comes after it, 0.4 s at most.
  const double after = std::min(0.25 * result.seconds, 0.4);
  const double prepared = PreparationSeconds(job);
  for (const double factor : {1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0}) {
    std::vector<double> seconds(kPlans), regrets(kPlans);
    parallel.For(kPlans, [&](size_t k) {
      planning::PlanningConfig config = job.config;
      config.seed = k + 1;
      parallel::Serial serial;
      planning::Plan plan;
      seconds[k] = ThreadSeconds([&] {
        plan = planning::MakePlan(*job.model, job.scanner, config,
                                  CpuBudget(prepared + factor * (result.seconds + after)), serial,
                                  [](const planning::Plan&) {})
                   .value();
      });
      regrets[k] = judge.Regret(plan);
    });
    result.plan_worst = Percentile(regrets, 1);
    if (result.plan_worst > kEnough) continue;
    result.plan = Percentile(seconds, 0.5);
    return;
  }
}

Fastest FastestOn(const PlanningJob& job, const AnswerJudge& judge, int runs,
                  std::span<const double> parts, parallel::Parallel& parallel) {
  Fastest result;
  result.brute = judge.brute_seconds();
  for (const double part : parts) {
    const double seconds = judge.brute_seconds() / part;
    std::vector<double> regrets;
    // A few runs first, since most budgets that fail do so at once.
    for (const int count : {runs / 10, runs}) {
      regrets = Regrets(judge, 1, count, parallel,
                        [&](uint64_t seed) { return Ours(job, seed, CpuBudget(seconds)); });
      if (Percentile(regrets, 1) > kEnough) break;
    }
    const double worst = Percentile(regrets, 1);
    if (worst > kEnough) {
      result.tried = absl::StrFormat("%g times: %.2f %% of %d", part, 100 * worst, regrets.size());
      continue;
    }
    result.part = part;
    result.seconds = seconds;
    result.worst = worst;
    MeasureWholePlans(job, judge, parallel, result);
    return result;
  }
  return result;
}

// Points (scene and budget) at which the planner is no worse than the rival.
struct Points {
  int all = 0;
  int no_worse = 0;
};

// What is measured on models of one kind.
class KindBench {
 public:
  KindBench(const PlanningKind& kind, Figures& figures)
      : kind_(kind),
        figures_(figures),
        duels_wanted_(figures.Wants(absl::StrCat("plan.anytime.dominates.", kind.name))) {
    for (const char* figure : {"speedup", "worst_regret", "cpu_seconds"}) {
      fastest_wanted_ |= figures.Wants(absl::StrCat("plan.anytime.", figure, ".", kind.name));
    }
    curves_wanted_ = figures.Wants(absl::StrCat("plan.anytime.curve.", kind.name));
  }

  // `parts`: of brute force's time, shortest first; none: no such figures. `aims`: of the speedup
  // and of the seconds.
  void Run(const BenchOptions& options, int runs, std::span<const double> parts,
           const std::string& speedup_aim, const std::string& seconds_aim,
           parallel::Parallel& parallel) {
    fastest_wanted_ &= !parts.empty();
    curves_wanted_ &= !options.pictures.empty();
    if (!duels_wanted_ && !fastest_wanted_ && !curves_wanted_) return;
    if (duels_wanted_) tuned_ = TuneRival(kind_.tuning, parallel);
    bool first = true;
    for (const PlanningScene& scene : kind_.measured) {
      const std::unique_ptr<PlanningJob> job = scene.make(parallel);
      if (job == nullptr) {
        absl::FPrintF(stderr, "%s is not in VANTAGE_SHARED_DATA: not measured\n", scene.name);
        continue;
      }
      const AnswerJudge judge(*job, parallel);
      absl::StrAppendFormat(&scenes_, "%s%s (%s)", scenes_.empty() ? "" : ", ", scene.name,
                            job->Size());
      if (!tuned_.empty()) duels_.push_back(DuelOn(*job, judge, tuned_, parallel));
      if (fastest_wanted_) fastest_.push_back(FastestOn(*job, judge, runs, parts, parallel));
      if (first && curves_wanted_) DrawCurves(options.pictures, scene.name, *job, judge, parallel);
      first = false;
    }
    if (!duels_.empty()) ReportDuels();
    if (!fastest_.empty()) ReportFastest(runs, speedup_aim, seconds_aim);
  }

  const Points& points() const { return points_; }

 private:
  void DrawCurves(const std::string& folder, const std::string& scene, const PlanningJob& job,
                  const AnswerJudge& judge, parallel::Parallel& parallel) {
    const std::string path = absl::StrCat(folder, "/anytime-", kind_.name, ".svg");
    if (!DrawAnytimeCurves(path, absl::StrCat(kind_.name, ", ", scene), job, judge, parallel)) {
      absl::FPrintF(stderr, "cannot write %s\n", path);
    }
  }

  void ReportDuels() {
    std::string table;
    for (size_t b = 0; b < kBudgets.size(); ++b) {
      absl::StrAppendFormat(&table, "%s%g ms:", b == 0 ? "" : "; ", 1e3 * kBudgets[b]);
      for (const std::vector<Duel>& on_scene : duels_) {
        const Duel& duel = on_scene[b];
        ++points_.all;
        points_.no_worse += duel.ours <= duel.rivals + 1e-9;
        absl::StrAppendFormat(&table, " %.2f/%.2f", 100 * duel.ours, 100 * duel.rivals);
      }
      absl::StrAppendFormat(&table, " %% (lattice %d, %d draws)", tuned_[b].stride,
                            tuned_[b].draws);
    }
    figures_.Add({absl::StrCat("plan.anytime.dominates.", kind_.name),
                  static_cast<double>(points_.no_worse) / points_.all, "of points", "1",
                  absl::StrCat("95th-percentile regret (of 20 runs to 100 ms, then of 10) at CPU "
                               "budgets of step D, ours/the rival's "
                               "on ",
                               scenes_, "; the rival tuned for each budget on ", kind_.tuning.name,
                               "; ", table)});
  }

  void ReportFastest(int runs, const std::string& speedup_aim, const std::string& seconds_aim) {
    std::vector<double> parts, worst, plans;
    std::string by_scene, seconds;
    bool all_found = true;
    for (const Fastest& one : fastest_) {
      const char* comma = by_scene.empty() ? "" : ", ";
      parts.push_back(one.part);
      absl::StrAppendFormat(&by_scene, "%s%g (of %.1f s%s%s)", comma, one.part, one.brute,
                            one.tried.empty() ? "" : "; not ", one.tried);
      all_found &= one.part > 0;
      if (one.part <= 0) continue;
      worst.push_back(one.worst);
      const char* separator = seconds.empty() ? "" : "; ";
      if (one.plan <= 0) {
        absl::StrAppendFormat(&seconds, "%snone, the worst of the longest lost %.2f %%", separator,
                              100 * one.plan_worst);
        continue;
      }
      plans.push_back(one.plan);
      absl::StrAppendFormat(&seconds, "%s%.3f s where step D by itself takes %.3f", separator,
                            one.plan, one.seconds);
    }
    figures_.Add({absl::StrCat("plan.anytime.speedup.", kind_.name), Percentile(parts, 0.5),
                  "times", speedup_aim,
                  absl::StrFormat("median of %d scenes; step D in less CPU than brute force takes, "
                                  "for a regret of at most 0.5 %% in %d of %d runs: %s; on %s%s",
                                  fastest_.size(), runs, runs, by_scene, scenes_,
                                  all_found ? "" : "; 0: none found")});
    if (worst.empty()) return;
    figures_.Add({absl::StrCat("plan.anytime.worst_regret.", kind_.name),
                  100 * Percentile(worst, 1), "%", "0.5",
                  absl::StrCat("of those runs, on all scenes on which such a part was found")});
    if (plans.empty()) return;
    figures_.Add({absl::StrCat("plan.anytime.cpu_seconds.", kind_.name), Percentile(plans, 0.5),
                  "s", seconds_aim,
                  absl::StrCat("of one thread for a whole plan, steps A to F, at the least budget "
                               "at which 10 of 10 lose at most 0.5 %; median over the scenes: ",
                               seconds)});
  }

  const PlanningKind& kind_;
  Figures& figures_;
  bool duels_wanted_ = false;
  bool fastest_wanted_ = false;
  bool curves_wanted_ = false;
  std::vector<RivalSettings> tuned_;
  std::string scenes_;                    // in words
  std::vector<std::vector<Duel>> duels_;  // by scene and budget
  std::vector<Fastest> fastest_;          // by scene
  Points points_;
};

// Two threads compared with one on the same work, and a loop of plain arithmetic in the same way.
void BenchThreads(const PlanningKind& kind, parallel::Parallel& parallel, Figures& figures) {
  parallel::Serial serial;
  parallel::ThreadPool pool(2);
  volatile double factor = 0.999999;  // not to be known when this is compiled
  volatile double sink = 0;
  const auto loop = [&](parallel::Parallel& threads) {
    return WallSeconds([&] {
      threads.For(16, [&](size_t) {
        const double by = factor;
        double x = 1;
        for (int i = 0; i < 10'000'000; ++i) x = x * by + 1e-6;
        sink = x;
      });
    });
  };
  std::vector<double> plans, evaluations, loops;
  for (const PlanningScene& scene : kind.measured) {
    const std::unique_ptr<PlanningJob> job = scene.make(parallel);
    parallel::Budget budget;
    budget.work_limit = 10'000'000;
    const auto plan = [&](parallel::Parallel& threads) {
      return WallSeconds([&] {
        (void)planning::MakePlan(*job->model, job->scanner, job->config, budget, threads,
                                 [](const planning::Plan&) {});
      });
    };
    const auto evaluate = [&](parallel::Parallel& threads) {
      return WallSeconds([&] { (void)AnytimeEvaluation(*job, 1, budget, threads); });
    };
    for (int run = 0; run < 3; ++run) {  // in turn: what else the machine does meets all
      plans.push_back(plan(serial) / plan(pool));
      evaluations.push_back(evaluate(serial) / evaluate(pool));
      loops.push_back(loop(serial) / loop(pool));
    }
  }
  const double plain = Percentile(loops, 0.5);
  const std::string of = absl::StrFormat("plain arithmetic %.2f times; medians of %d, models %s",
                                         plain, loops.size(), kind.name);
  const double whole = Percentile(plans, 0.5);
  figures.Add(
      {"plan.threads2.speedup", whole / plain, "of a loop's", "0.95",
       absl::StrFormat("whole plans on 2 threads: %.2f times as fast as on 1; %s", whole, of)});
  const double part = Percentile(evaluations, 0.5);
  figures.Add({"plan.threads2.evaluation.speedup", part / plain, "of a loop's", "0.95",
               absl::StrFormat("step D alone: %.2f times as fast as on 1; %s", part, of)});
}

constexpr double kFlatParts[] = {800, 600, 400, 300, 200, 150, 100, 80,
                                 65,  50,  40,  30,  20,  15,  10,  5};
constexpr double kStoreyParts[] = {4000, 2800, 2000, 1400, 1000, 700, 500, 400, 300, 200, 100, 50};

}  // namespace

void BenchAnytime(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  Points points;
  const auto bench = [&](const PlanningKind& kind, int runs, std::span<const double> parts,
                         const std::string& speedup_aim, const std::string& seconds_aim) {
    KindBench of_kind(kind, figures);
    of_kind.Run(options, options.full ? 200 : runs, parts, speedup_aim, seconds_aim, parallel);
    points.all += of_kind.points().all;
    points.no_worse += of_kind.points().no_worse;
  };
  bench(FlatsAfter(1, options.use), 0, {}, "", "");
  bench(FlatsAfter(3, options.use), 100, kFlatParts, "50", "");
  bench(RoomsAfter(1, options.use), 100, kFlatParts, "", "");
  bench(Meshes(options.use), 40, kFlatParts, "", "");
  bench(OfficeStoreys(250, options.use), 40, kStoreyParts, "", "");
  if (options.full) {  // where all views have to be scored exactly, to know what is lost
    bench(HallsAfter(3, options.use), 40, kStoreyParts, "", "");
    bench(OfficeStoreys(1000, options.use), 40, kStoreyParts, "400", "1");
  }
  if (points.all > 0) {
    figures.Add({"plan.anytime.dominates",
                 static_cast<double>(points.no_worse) / static_cast<double>(points.all),
                 "of points", "1",
                 absl::StrCat(points.no_worse, " of ", points.all,
                              " points (scenes x budgets) at which our 95th-percentile regret is "
                              "no worse than that of the rival, tuned for each budget on another "
                              "scene of its kind")});
  }
  if (figures.Wants("plan.threads2.")) BenchThreads(FlatsAfter(3, options.use), parallel, figures);
}

}  // namespace vantage::bench
