// Exact scores of all views: the hierarchy against brute force with packets, in flats, halls and on
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
#include "tests/bench/scenes.h"

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
    hierarchy = planning::HierarchicalScorer::Create(
                    job.scoring->scorer(), job.grid, job.scoring->cells(), job.feasible.cells(),
                    job.feasible.cell_size(), options, unlimited, serial)
                    .value();
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

// Of all views of a scene, one thread.
struct Cost {
  double hierarchy = 0;  // s
  double brute = 0;
};

Cost CostOf(const PlanningJob& job, const Comparison& c) {
  const auto all = static_cast<double>(job.views.size());
  return {c.build + c.hierarchy * all / static_cast<double>(c.views),
          c.brute * all / static_cast<double>(c.drawn)};
}

double RayRatio(const Comparison& c) {
  return static_cast<double>(c.brute_rays) / static_cast<double>(c.their_rays);
}

// Medians over the scenes of a kind.
Cost Report(const std::string& name, const std::string& aim, const PlanningKind& kind,
            size_t stride, double share_drawn, parallel::Parallel& parallel, Figures& figures) {
  std::vector<double> speedups, hierarchies, brutes, rays;
  std::string by_scene;
  for (const PlanningScene& scene : kind.measured) {
    const std::unique_ptr<PlanningJob> job = scene.make(parallel);
    const Comparison c = Compare(*job, {}, stride, share_drawn);
    const Cost cost = CostOf(*job, c);
    speedups.push_back(cost.brute / cost.hierarchy);
    hierarchies.push_back(cost.hierarchy);
    brutes.push_back(cost.brute);
    rays.push_back(RayRatio(c));
    absl::StrAppendFormat(&by_scene,
                          "; %s, %s: %.2f times, brute force %.1f s on %d views drawn at random, "
                          "%.1f M rays/s, hierarchy %.2f s for what comes once, %.1f s on %d views "
                          "in whole blocks, rms %.1e",
                          scene.name, job->Size(), speedups.back(), c.brute, c.drawn,
                          static_cast<double>(c.brute_rays) / 1e6 / c.brute, c.build, c.hierarchy,
                          c.views, c.rms);
  }
  const std::string of = absl::StrFormat("median of %d scenes", speedups.size());
  const Cost median{Percentile(hierarchies, 0.5), Percentile(brutes, 0.5)};
  figures.Add({absl::StrCat("plan.exact.speedup.", name), Percentile(speedups, 0.5), "times", aim,
               absl::StrCat(of, ", CPU of one thread", by_scene)});
  figures.Add(
      {absl::StrCat("plan.exact.seconds.", name), median.hierarchy, "s", "",
       absl::StrFormat("of all views; %s, %.1f to %.1f s; brute force %.1f s", of,
                       Percentile(hierarchies, 0), Percentile(hierarchies, 1), median.brute)});
  figures.Add({absl::StrCat("plan.exact.rays.", name), Percentile(rays, 0.5), "times fewer", "",
               absl::StrFormat("rays of brute force over those of the hierarchy, the same views; "
                               "%s, %.2f to %.2f",
                               of, Percentile(rays, 0), Percentile(rays, 1))});
  return median;
}

void ReportRays(const PlanningKind& kind, parallel::Parallel& parallel, Figures& figures) {
  std::vector<double> ratios;
  std::string by_scene;
  planning::HierarchyOptions options;
  options.leaf_views = 1;
  options.tolerance = planning::PlanningConfig().density_tolerance;
  for (const PlanningScene& scene : kind.measured) {
    const std::unique_ptr<PlanningJob> job = scene.make(parallel);
    const Comparison c = Compare(*job, options, 6, 1.0);
    ratios.push_back(RayRatio(c));
    absl::StrAppendFormat(&by_scene, "; %s: %.2f, rms %.1e, %d views, %.1f s to brute force's %.1f",
                          scene.name, ratios.back(), c.rms, c.views, c.hierarchy, c.brute);
  }
  figures.Add({"plan.exact.ray_ratio", Percentile(ratios, 0.5), "times fewer", "10",
               absl::StrFormat("leaves of one view and one packet of 8 cells, epsilon %g, aim of "
                               "the rms 1e-3; median of %d scenes%s",
                               options.tolerance, ratios.size(), by_scene)});
}

}  // namespace

void BenchEvaluator(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const auto wanted = [&](const std::string& name) {
    return figures.Wants(absl::StrCat("plan.exact.speedup.", name)) ||
           figures.Wants(absl::StrCat("plan.exact.seconds.", name)) ||
           figures.Wants(absl::StrCat("plan.exact.rays.", name));
  };
  if (wanted("flat")) {
    Report("flat", "2", FlatsAfter(3, options.use), 1, 0.3, parallel, figures);
  }
  if (figures.Wants("plan.exact.ray_ratio")) {
    ReportRays(FlatsAfter(3, options.use), parallel, figures);
  }
  if (wanted("hall")) {
    Report("hall", "", HallsAfter(3, options.use), 16, 0.06, parallel, figures);
  }
  const auto storeys = [&](double area, const std::string& aim, size_t stride, double share) {
    return Report(absl::StrCat(area, "m2"), aim, OfficeStoreys(area, options.use), stride, share,
                  parallel, figures);
  };
  const bool growth = options.full && figures.Wants("plan.exact.area_exponent");
  Cost small, large;
  if (growth || wanted("250m2")) small = storeys(250, "", 2, 0.07);
  if (!options.full) return;
  if (wanted("500m2")) (void)storeys(500, "", 5, 0.06);
  if (wanted("1000m2")) (void)storeys(1000, "10", 10, 0.06);
  if (growth || wanted("2000m2")) large = storeys(2000, "", 40, 0.06);
  if (!growth) return;
  const auto exponent = [](double from, double to) { return std::log(to / from) / std::log(8.0); };
  figures.Add({"plan.exact.area_exponent", exponent(small.hierarchy, large.hierarchy), "", "1",
               absl::StrFormat("growth from 250 to 2,000 m2; brute force %.2f",
                               exponent(small.brute, large.brute))});
}

}  // namespace vantage::bench
