// Whether the overlap that is predicted of a view is the overlap that the verdict on a scan from
// there states.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/small_scenes.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/registration_trials.h"
#include "tests/bench/repetitive_scenes.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr size_t kViews = 12;        // of a scene
constexpr double kViewsNear = 8;     // m, from the first station
constexpr double kWellKnown = 0.02;  // m, one sigma of priors: the pose is not in question here
// Below there is not enough that two figures could agree on.
constexpr double kLeastOverlap = 0.05;

// Ratios of the verdict's overlap to the predicted one, of feasible views that register or whose
// scan is refused for its geometry alone.
std::vector<double> RatiosIn(const RepetitiveScene& scene, uint64_t seed,
                             parallel::Parallel& parallel) {
  RegistrationTrials trials(scene, seed, parallel);
  const planning::PlanningConfig config;
  const auto problem =
      planning::PlanningProblem::Prepare({trials.view(), sensor::ScannerModel{}, config}, parallel)
          .value();
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 79);
  std::vector<double> ratios;
  for (int tries = 0; tries < 400 && ratios.size() < kViews; ++tries) {
    const Vector3d at =
        scene.scanned.front() + Vector3d(random.Between(-kViewsNear, kViewsNear),
                                         random.Between(-kViewsNear, kViewsNear), 0);
    const auto evaluated = planning::EvaluateView(*problem, at).value();
    if (!evaluated.feasible) continue;
    const double predicted = evaluated.view.verdict.overlap_share;
    const RegistrationTrial trial =
        trials.Register(at, kWellKnown, StatedPrior::kWithItsSigma, config.registration);
    const double found = trial.result.verdict.overlap_share;
    if (trial.off > 0.05 || std::min(found, predicted) < kLeastOverlap) continue;
    ratios.push_back(found / predicted);
  }
  return ratios;
}

RepetitiveScene FromStart(simulation::Scene of) {
  RepetitiveScene scene;
  scene.scanned = {of.starts[0]};
  scene.mesh = std::move(of.mesh);
  return scene;
}

}  // namespace

void BenchOverlap(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("predict.overlap.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 12 : 4;
  using Make = RepetitiveScene (*)(uint64_t);
  constexpr std::array<std::pair<const char*, Make>, 6> kKinds = {{
      {"flats", [](uint64_t s) { return FromStart(simulation::FurnishedFlat(s)); }},
      {"offices", [](uint64_t s) { return FromStart(simulation::OfficeStorey(s, 150)); }},
      {"corridors", DoorCorridor},
      {"pillars", [](uint64_t s) { return FromStart(simulation::PillarHall(s)); }},
      {"halls", [](uint64_t s) { return FromStart(simulation::LargeHall(s)); }},
      {"courtyards", [](uint64_t s) { return FromStart(simulation::CourtyardScene(s)); }},
  }};
  for (const auto& [name, make] : kKinds) {
    const std::string of = absl::StrCat("predict.overlap.", name);
    if (!figures.Wants(of)) continue;
    std::vector<double> ratios;
    for (uint64_t seed = first; seed < first + scenes; ++seed) {
      const std::vector<double> in_scene = RatiosIn(make(seed), seed, parallel);
      ratios.insert(ratios.end(), in_scene.begin(), in_scene.end());
    }
    if (ratios.empty()) continue;
    figures.Add(
        {of, Percentile(ratios, 0.5), "", "1",
         absl::StrFormat("the verdict's overlap over the predicted, median of %d views; "
                         "five of six above %.2f, five of six below %.2f",
                         ratios.size(), Percentile(ratios, 1.0 / 6), Percentile(ratios, 5.0 / 6))});
  }
}

}  // namespace vantage::bench
