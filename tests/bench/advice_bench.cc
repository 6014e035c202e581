// Views that plans refuse, and what becomes of their scans with the targets that are advised.
#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/planner.h"
#include "core/planning/ranking/target_advice.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/registration_trials.h"
#include "tests/bench/repetitive_scenes.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr double kAdvicePlanSeconds = 2;
constexpr double kAdvicePrior = 1;  // m, one sigma, that priors state and have

struct Advised {
  size_t refused = 0;
  size_t advised = 0;
  size_t targets = 0;
  size_t without = 0;  // registered without
  size_t with = 0;     // registered with them, at the right place
  size_t wrong = 0;    // more than three times the bound off
  std::vector<double> milliseconds;
};

void ScanAdvised(const RepetitiveScene& scene, uint64_t seed, Advised& advised,
                 parallel::Parallel& parallel) {
  RegistrationTrials trials(scene, seed, parallel);
  planning::PlanningConfig config;
  config.registration.prior_sigma = kAdvicePrior;
  const sensor::ScannerModel scanner;
  const auto problem =
      planning::PlanningProblem::Prepare({trials.view(), scanner, config}, parallel).value();
  const planning::Plan plan =
      planning::MakePlan(*problem, parallel::Budget::Seconds(kAdvicePlanSeconds), parallel,
                         [](const planning::Plan&) {});
  for (const planning::RankedView& view : plan.refused) {
    ++advised.refused;
    uint64_t rays = 0;
    const auto started = std::chrono::steady_clock::now();
    const auto advice =
        planning::FindTargets(*problem, view, plan.views.empty() ? nullptr : &plan.views.front(),
                              parallel::Budget::Unlimited(), rays);
    advised.milliseconds.push_back(
        1000 * std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count());
    if (!advice.has_value()) continue;
    ++advised.advised;
    std::vector<Vector3d> places;
    for (const planning::TargetPlace& place : advice->places) places.push_back(place.position);
    advised.targets += places.size();
    const auto scan = [&](std::span<const Vector3d> targets) {
      return trials.Register(view.position, kAdvicePrior, StatedPrior::kWithItsSigma, {}, targets);
    };
    advised.without += scan({}).result.verdict.registered() ? 1 : 0;
    const RegistrationTrial with = scan(places);
    if (!with.result.verdict.registered()) {
      absl::PrintF("  with %d targets: %s\n", places.size(), with.result.verdict.reason);
      continue;
    }
    ++(with.off > 3 * with.result.verdict.error_bound ? advised.wrong : advised.with);
  }
}

}  // namespace

void BenchAdvice(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("advice.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 12 : 3;
  using Make = RepetitiveScene (*)(uint64_t);
  constexpr std::array<std::pair<const char*, Make>, 4> kKinds = {{
      {"doors", DoorCorridor},
      {"pillars", [](uint64_t s) { return PillarCorridor(s, 0); }},
      {"marked", [](uint64_t s) { return PillarCorridor(s, 6); }},
      {"decks", ParkingDeck},
  }};
  for (const auto& [name, make] : kKinds) {
    const std::string figure = absl::StrCat("advice.helps.", name);
    if (!figures.Wants(figure)) continue;
    Advised advised;
    for (uint64_t seed = first; seed < first + scenes; ++seed) {
      ScanAdvised(make(seed), seed, advised, parallel);
    }
    const auto all = static_cast<double>(std::max<size_t>(1, advised.advised));
    figures.Add({figure, static_cast<double>(advised.with) / all, "", "",
                 absl::StrFormat(
                     "of %d views advised on, of %d refused; %d register without, %d wrong; "
                     "%.1f targets each; %.0f ms (median)",
                     advised.advised, advised.refused, advised.without, advised.wrong,
                     static_cast<double>(advised.targets) / all,
                     advised.milliseconds.empty() ? 0.0 : Percentile(advised.milliseconds, 0.5))});
  }
}

}  // namespace vantage::bench
