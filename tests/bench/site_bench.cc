// Where views stand on sites with edges and floors over one another, what views under the open sky
// promise and attain, and what is said of coverage at the end of jobs, against the mesh.
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
#include "core/simulation/ground_truth.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/scene_use.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/standable_positions.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/outdoor_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/closed_loop.h"
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
  size_t with_targets = 0;
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
      with_targets += job.with_targets;
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
      absl::StrCat("the mesh, ", jobs, " jobs, ", scans, " scans, ", with_targets,
                   " of them with targets as advised, ", stopped, " ended");
  figures.Add({"site.outdoor.promised_sky", promised > 0 ? sky / promised : 0, "", "0.02", of});
  figures.Add(
      {"site.outdoor.coverage", least_attained, "", "0.95", absl::StrCat(of, ", the worst")});
  figures.Add(
      {"site.outdoor.coverage_error", most_off, "points", "5", absl::StrCat(of, ", the worst")});
}

constexpr double kHeight = 1.5;      // m, of places from which surface is attainable
constexpr double kSpacing = 0.25;    // m, between them
constexpr size_t kSamples = 20'000;  // of the mesh
constexpr int kMostScans = 25;       // of a job

// The estimated coverage at the end of a job, less that by the mesh, in points.
double CoverageError(const simulation::Scene& scene, uint64_t seed, parallel::Parallel& parallel) {
  test_support::LoopOptions options;
  options.max_scans = kMostScans;
  options.seed = seed;
  const test_support::LoopResult job = test_support::RunClosedLoop(
      [&](int, const Eigen::Vector3d&) { return scene.mesh; }, scene.starts[0], options, parallel);
  const simulation::SimulatedScanner tracer(scene.mesh);
  const sensor::ScannerModel& scanner = options.scanner;
  std::vector<Eigen::Vector3d> positions =
      simulation::StandablePositions(tracer, scene.mesh.Bounds(), scene.starts[0],
                                     scene.floor_height, kHeight, scanner.clearance, kSpacing);
  positions.insert(positions.end(), job.stations.begin(), job.stations.end());
  simulation::GroundTruth truth(scene.mesh, tracer, scanner, options.planning.required_density,
                                positions, kSamples, parallel);
  for (const Eigen::Vector3d& station : job.stations) truth.AddScan(station, parallel);
  const planning::Coverage coverage = job.plans.back().coverage.value();
  const double estimated = 100 * coverage.estimated_coverage.value_or(0);
  const double by_mesh = 100 * truth.Measure().at_density_share();
  std::fprintf(
      stderr,
      "%s: %zu scans, %s, coverage %.1f %% estimated, %.1f %% by the mesh, %d rooms not entered\n",
      scene.name.c_str(), job.stations.size(), job.stopped ? "stopped" : "not stopped", estimated,
      by_mesh, coverage.openings.RoomsNotEntered());
  return estimated - by_mesh;
}

void BenchCoverage(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("site.coverage.")) return;
  std::vector<double> errors;
  for (const uint64_t seed : SceneSeeds(options.use)) {
    errors.push_back(std::abs(CoverageError(simulation::TwoRooms(seed), seed, parallel)));
    if (!options.full) break;
    errors.push_back(std::abs(CoverageError(simulation::FurnishedFlat(seed), seed, parallel)));
  }
  figures.Add({"site.coverage.error", *std::max_element(errors.begin(), errors.end()), "points",
               "5", absl::StrCat("the mesh, the worst of ", errors.size(), " whole jobs")});
}

}  // namespace

void BenchSite(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  BenchOutdoor(options, parallel, figures);
  BenchCoverage(options, parallel, figures);
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
  const uint64_t first =
      options.use == simulation::SceneUse::kReporting ? simulation::kFirstReportingSeed : 1;
  for (uint64_t seed = first; seed < first + scenes; ++seed) {
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
