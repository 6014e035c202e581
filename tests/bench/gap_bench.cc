// How much the stated optimality gap says at short budgets, beside the true regret.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/planner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/planning_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr std::array kGapBudgets = {0.2, 0.5, 1.0};  // s
constexpr size_t kScenesOfKind = 2;

}  // namespace

void BenchGap(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("gap.")) return;
  std::vector<PlanningKind> kinds = {FlatsAfter(1, options.use), FlatsAfter(3, options.use),
                                     RoomsAfter(1, options.use), HallsAfter(3, options.use),
                                     OfficeStoreys(250, options.use)};
  if (options.full) kinds.push_back(OfficeStoreys(1000, options.use));
  std::array<std::vector<double>, kGapBudgets.size()> gaps;
  std::array<std::string, kGapBudgets.size()> each;
  for (const PlanningKind& kind : kinds) {
    for (size_t i = 0; i < std::min(kScenesOfKind, kind.measured.size()); ++i) {
      const std::unique_ptr<PlanningJob> job = kind.measured[i].make(parallel);
      if (job == nullptr) continue;
      for (size_t b = 0; b < kGapBudgets.size(); ++b) {
        const planning::Plan plan =
            planning::MakePlan(*job->problem, parallel::Budget::Seconds(kGapBudgets[b]), parallel,
                               [](const planning::Plan&) {});
        gaps[b].push_back(plan.optimality_gap);
        double most_map = 0, most_up = 0;
        for (const auto& c : plan.score_map) {
          most_map = std::max(most_map, double(c.score));
          most_up = std::max(most_up, double(c.upper));
        }
        double max_all = 0;
        std::fprintf(stderr,
                     "%s %.1f: gap %.3f complete %d confidence %.3f views %zu refused %zu first "
                     "%.4g lower %.4g map %.4g up %.4g cells %zu of %zu rays %llu\n",
                     kind.measured[i].name.c_str(), kGapBudgets[b], plan.optimality_gap,
                     plan.complete, plan.confidence, plan.views.size(), plan.refused.size(),
                     plan.views.empty() ? 0 : plan.views[0].score,
                     plan.views.empty() ? 0 : plan.views[0].lower, most_map, most_up,
                     plan.score_map.size(), plan.feasible_cells, (unsigned long long)plan.rays);
        (void)max_all;
        for (const auto& r : plan.refused)
          std::fprintf(stderr, "   refused %.4g %s\n", r.score, r.verdict.reason.c_str());
        absl::StrAppendFormat(&each[b], "%s%s %.2f", each[b].empty() ? "" : ", ",
                              kind.measured[i].name, plan.optimality_gap);
      }
    }
  }
  for (size_t b = 0; b < kGapBudgets.size(); ++b) {
    figures.Add({absl::StrFormat("gap.at_%.0fms", 1000 * kGapBudgets[b]), Percentile(gaps[b], 0.5),
                 "", kGapBudgets[b] == 0.5 ? "0.05" : "", each[b]});
  }
}

}  // namespace vantage::bench
