// Where views stand on sites with edges and floors over one another, against the mesh.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/planning_config.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "tests/bench/benchmarks.h"
#include "tests/support/standing_oracle.h"

namespace vantage::bench {

void BenchSite(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("site.")) return;
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
