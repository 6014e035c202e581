// Exact scores of all views: the hierarchy against brute force with packets, in a flat and on
// office storeys.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/evaluation/hierarchy.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

namespace {

// Every `stride`-th block of views by the hierarchy, and some of their views, drawn at random, by
// brute force, in turn: a change in the machine's speed meets both. One thread, CPU seconds.
struct Comparison {
  size_t views = 0;         // of the blocks
  size_t drawn = 0;         // by brute force
  double build = 0;         // s: trees and counts, upper levels for all views
  double hierarchy = 0;     // s, lower levels for the blocks
  double brute = 0;         // s, for the views drawn
  uint64_t rays = 0;        // of the hierarchy, for the blocks
  uint64_t their_rays = 0;  // of the hierarchy, for the views drawn
  uint64_t brute_rays = 0;
  double rms = 0;  // of the views drawn, relative to the root mean square of brute force
};

Comparison Compare(const PlanningJob& job, const planning::HierarchyOptions& options, size_t stride,
                   double share_drawn) {
  parallel::Serial serial;
  const parallel::Budget unlimited = parallel::Budget::Unlimited();
  Comparison result;
  std::unique_ptr<planning::HierarchicalScorer> hierarchy;
  result.build = ThreadSeconds([&] {
    hierarchy = planning::HierarchicalScorer::Create(job.scoring->scorer(), job.grid,
                                                     job.scoring->cells(), job.feasible.cells(),
                                                     job.feasible.cell_size(), options, serial)
                    .value();
    hierarchy->Cull(unlimited, serial);
  });
  std::mt19937_64 random(1);
  double square = 0;
  double reference = 0;
  std::vector<planning::ViewScore> scores;
  for (size_t b = stride / 2; b < hierarchy->blocks().size(); b += stride) {
    const planning::ViewBlock& block = hierarchy->blocks()[b];
    const std::span<const uint32_t> views = hierarchy->Views(block);
    scores.assign(views.size(), {});
    result.views += views.size();
    result.hierarchy += ThreadSeconds([&] { hierarchy->ScoreBlock(block, unlimited, scores); });
    for (size_t k = 0; k < views.size(); ++k) {
      result.rays += scores[k].rays;
      if (static_cast<double>(random() >> 11) * 0x1p-53 >= share_drawn) continue;
      planning::ViewScore truth;
      result.brute += ThreadSeconds([&] {
        truth = job.scoring->scorer().Score(job.views[views[k]], job.scoring->cells(), unlimited);
      });
      ++result.drawn;
      result.brute_rays += truth.rays;
      result.their_rays += scores[k].rays;
      square += (scores[k].score - truth.score) * (scores[k].score - truth.score);
      reference += truth.score * truth.score;
    }
  }
  result.rms = reference > 0 ? std::sqrt(square / reference) : 0;
  return result;
}

// Of all views, one thread.
struct Cost {
  double hierarchy = 0;  // s
  double brute = 0;
};

Cost Report(const std::string& name, const std::string& aim, const PlanningJob& job, size_t stride,
            double share_drawn, Figures& figures) {
  const Comparison c = Compare(job, {}, stride, share_drawn);
  const auto all = static_cast<double>(job.views.size());
  const Cost cost{c.build + c.hierarchy * all / static_cast<double>(c.views),
                  c.brute * all / static_cast<double>(c.drawn)};
  figures.Add({absl::StrCat("plan.exact.speedup.", name), cost.brute / cost.hierarchy, "times", aim,
               absl::StrFormat("%s, CPU of one thread; brute force %.1f s on %d views drawn at "
                               "random, %.1f M rays/s; hierarchy %.2f s for what comes once, "
                               "%.1f s on %d views in whole blocks; rms %.1e",
                               job.Size(), c.brute, c.drawn,
                               static_cast<double>(c.brute_rays) / 1e6 / c.brute, c.build,
                               c.hierarchy, c.views, c.rms)});
  figures.Add({absl::StrCat("plan.exact.seconds.", name), cost.hierarchy, "s", "",
               absl::StrFormat("of all views; brute force %.1f s", cost.brute)});
  figures.Add({absl::StrCat("plan.exact.rays.", name),
               static_cast<double>(c.brute_rays) / static_cast<double>(c.their_rays), "times fewer",
               "", "rays of brute force over those of the hierarchy, the same views"});
  return cost;
}

void ReportRays(const PlanningJob& job, Figures& figures) {
  planning::HierarchyOptions options;
  options.leaf_views = 1;
  options.tolerance = job.config.density_tolerance;
  const Comparison c = Compare(job, options, 6, 1.0);
  figures.Add({"plan.exact.ray_ratio",
               static_cast<double>(c.brute_rays) / static_cast<double>(c.their_rays), "times fewer",
               "10",
               absl::StrFormat("leaves of one view and one packet of 8 cells, epsilon %g: rms "
                               "%.1e, aim 1e-3; %d views of the flat, %.1f s to brute force's "
                               "%.1f s",
                               options.tolerance, c.rms, c.views, c.hierarchy, c.brute)});
}

}  // namespace

void BenchEvaluator(bool full, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("plan.exact.")) return;
  {
    const std::unique_ptr<PlanningJob> job = FlatPlanningJob(3, parallel);
    Report("flat", "2", *job, 1, 0.3, figures);
    ReportRays(*job, figures);
  }
  const Cost small = Report("250m2", "", *OfficePlanningJob(250, parallel), 2, 0.07, figures);
  if (!full) return;
  Report("500m2", "", *OfficePlanningJob(500, parallel), 5, 0.06, figures);
  Report("1000m2", "10", *OfficePlanningJob(1000, parallel), 10, 0.06, figures);
  const Cost large = Report("2000m2", "", *OfficePlanningJob(2000, parallel), 40, 0.06, figures);
  const auto exponent = [](double from, double to) { return std::log(to / from) / std::log(8.0); };
  figures.Add({"plan.exact.area_exponent", exponent(small.hierarchy, large.hierarchy), "", "1",
               absl::StrFormat("growth from 250 to 2,000 m2; brute force %.2f",
                               exponent(small.brute, large.brute))});
}

}  // namespace vantage::bench
