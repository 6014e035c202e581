// Where views stand on sites with edges and floors over one another, and what views under the open
// sky promise and attain, against the mesh.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/planning_config.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/outdoor_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/standing_oracle.h"

namespace vantage::bench {
namespace {

// Whole jobs in outdoor scenes.
void BenchOutdoor(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("site.outdoor.")) return;
  struct Kind {
    const char* name;
    simulation::Scene (*build)(uint64_t seed);
  };
  constexpr std::array<Kind, 4> kKinds = {{{"facade", simulation::FacadeScene},
                                           {"courtyard", simulation::CourtyardScene},
                                           {"street", simulation::StreetScene},
                                           {"slope", simulation::SlopeScene}}};
  constexpr size_t kMostScans = 24;
  std::vector<uint64_t> seeds = SceneSeeds(options.use);
  if (!options.full) seeds.resize(1);
  double promised = 0;
  double sky = 0;
  double least_attained = 1;
  double most_off = 0;
  size_t jobs = 0;
  size_t scans = 0;
  size_t stopped = 0;
  for (const Kind& kind : kKinds) {
    const std::string name = absl::StrCat("site.outdoor.", kind.name, ".");
    if (!figures.Wants(name) && !figures.Wants("site.outdoor.promised_sky")) continue;
    for (const uint64_t seed : seeds) {
      const OutdoorJobResult job = RunOutdoorJob(kind.build(seed), kMostScans, parallel);
      promised += job.promised;
      sky += job.promised_sky;
      least_attained = std::min(least_attained, job.attained);
      most_off = std::max(most_off, 100 * std::abs(job.estimated - job.attained));
      ++jobs;
      scans += job.scans;
      stopped += job.stopped ? 1 : 0;
      if (seed != seeds.front()) continue;
      const std::string of = absl::StrCat(job.scans, " scans, ", job.stopped ? "ended" : "cut off");
      figures.Add({name + "promised_sky", job.sky_share(), "", "", of});
      figures.Add({name + "coverage", job.attained, "", "", of});
      figures.Add({name + "estimated", job.estimated, "", "", of});
    }
  }
  if (jobs < kKinds.size()) return;
  const std::string of =
      absl::StrCat("the mesh, ", jobs, " jobs, ", scans, " scans, ", stopped, " ended");
  figures.Add({"site.outdoor.promised_sky", promised > 0 ? sky / promised : 0, "", "0.02", of});
  figures.Add(
      {"site.outdoor.coverage", least_attained, "", "0.95", absl::StrCat(of, ", the worst")});
  figures.Add(
      {"site.outdoor.coverage_error", most_off, "points", "5", absl::StrCat(of, ", the worst")});
}

}  // namespace

void BenchSite(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  BenchOutdoor(options, parallel, figures);
  if (!figures.Wants("site.views_in_air") && !figures.Wants("site.station_recall")) return;
  const uint64_t scenes = options.full ? 1000 : 20;
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  const planning::PlanningConfig config;
  size_t in_air = 0;
  size_t feasible = 0;
  size_t allowed = 0;
  size_t found = 0;
  double worst = 1;
  for (uint64_t seed = 1; seed <= scenes; ++seed) {
    const simulation::Scene scene = simulation::RandomEdgeScene(seed);
    const auto model = test_support::ScanFromStarts(scene, scanner, parallel);
    const auto views = planning::FeasibleViews::Find(*model, visibility::OpaqueGrid(*model),
                                                     scanner, config, parallel)
                           .value();
    const test_support::StandingFigures judged =
        test_support::JudgeStanding(scene, *model, views, scanner, config);
    if (judged.in_air > 0) std::fprintf(stderr, "%s: in the air\n", scene.name.c_str());
    in_air += judged.in_air;
    feasible += judged.feasible;
    allowed += judged.allowed;
    found += judged.found;
    worst = std::min(worst, judged.recall());
  }
  const std::string of = absl::StrCat("the mesh, ", scenes, " random edge scenes, ");
  figures.Add({"site.views_in_air", static_cast<double>(in_air), "views", "0",
               absl::StrCat(of, feasible, " views")});
  figures.Add({"site.station_recall",
               allowed == 0 ? 1 : static_cast<double>(found) / static_cast<double>(allowed), "",
               "0.95", absl::StrCat(of, allowed, " places")});
  figures.Add({"site.station_recall.worst", worst, "", "", of});
}

}  // namespace vantage::bench
