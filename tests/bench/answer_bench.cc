// Measures whether plans answer within short budgets, idle and on a busy machine, and how soon.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/planning_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {

namespace {

constexpr std::array<double, 3> kBudgets = {0.25, 0.5, 1.0};  // s
constexpr int kBusyLoops = 6;

// Threads that take what they can of the machine.
class BusyLoops {
 public:
  explicit BusyLoops(int count) {
    for (int i = 0; i < count; ++i) {
      threads_.emplace_back([this] {
        while (!stop_.load(std::memory_order_relaxed)) {
        }
      });
    }
  }
  ~BusyLoops() { stop_ = true; }
  BusyLoops(const BusyLoops&) = delete;
  BusyLoops& operator=(const BusyLoops&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::vector<std::jthread> threads_;
};

struct Answers {
  size_t plans = 0;
  size_t with_views = 0;
  double most_over = 0;  // s beyond the budget

  void Plan(const PlanningJob& job, double budget, parallel::Parallel& parallel) {
    planning::Plan plan;
    const double took = WallSeconds([&] {
      plan =
          planning::MakePlan(*job.model, job.scanner, job.config, parallel::Budget::Seconds(budget),
                             parallel, [](const planning::Plan&) {})
              .value();
    });
    ++plans;
    with_views += plan.views.empty() ? 0 : 1;
    most_over = std::max(most_over, took - budget);
    if (plan.views.empty()) {
      std::fprintf(stderr, "%s, %.2f s: %s\n", job.Size().c_str(), budget, plan.message.c_str());
    }
  }
};

// ms from the call to the first plan shown whose first view is checked.
double FirstViewMilliseconds(const PlanningJob& job, parallel::Parallel& parallel) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  double first = 0;
  (void)planning::MakePlan(
      *job.problem, parallel::Budget::Seconds(1), parallel, [&](const planning::Plan& so_far) {
        if (first > 0 || so_far.views.empty() || !so_far.views[0].checked) return;
        first = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
      });
  return first;
}

}  // namespace

void BenchAnswers(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("plan.answered") && !figures.Wants("plan.first_view.")) return;
  Answers idle;
  Answers busy;
  std::vector<double> first_view;
  for (const PlanningKind& kind : {FlatsAfter(1, options.use), FlatsAfter(3, options.use),
                                   HallsAfter(3, options.use), OfficeStoreys(1000, options.use)}) {
    for (const PlanningScene& scene : kind.measured) {
      const std::unique_ptr<PlanningJob> job = scene.make(parallel);
      for (const double budget : kBudgets) {
        idle.Plan(*job, budget, parallel);
        const BusyLoops loops(kBusyLoops);
        busy.Plan(*job, budget, parallel);
      }
      if (kind.name == "1000m2") {
        for (int run = 0; run < 5; ++run) {
          first_view.push_back(FirstViewMilliseconds(*job, parallel));
        }
      }
    }
  }
  const auto add = [&](const std::string& name, const Answers& answers) {
    figures.Add({name, static_cast<double>(answers.with_views) / answers.plans, "", "1",
                 absl::StrCat("of ", answers.plans, " plans of 0.25 to 1 s, unprepared")});
    figures.Add({absl::StrCat(name, ".over"), answers.most_over, "s", "",
                 "beyond the budget, preparing included, the worst"});
  };
  add("plan.answered", idle);
  add("plan.answered.busy", busy);
  figures.Add({"plan.first_view.1000m2.ms", Percentile(first_view, 0.5), "ms", "50",
               absl::StrCat("median of ", first_view.size(), ", prepared")});
}

}  // namespace vantage::bench
