// What is promised of views before anybody stands there, beside what becomes of their scans.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/planner.h"
#include "core/registration/bound/verdict.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/registration_trials.h"
#include "tests/bench/repetitive_scenes.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

// How the priors of a session's scans are made.
struct PriorKind {
  const char* name;
  double sigma;        // m, what they are off
  StatedPrior stated;  // whether the session says so
};
// Spots shown on a plan, half a metre off at two sigma, of which nothing is said; a vendor's own
// registration; spots on a plan of a bare building; of a site that nobody has drawn.
constexpr std::array kPriorKinds = {PriorKind{"guess", 0.25, StatedPrior::kGuess},
                                    PriorKind{"5cm", 0.05, StatedPrior::kWithItsSigma},
                                    PriorKind{"1m", 1.0, StatedPrior::kWithItsSigma},
                                    PriorKind{"2m", 2.0, StatedPrior::kWithItsSigma}};
constexpr const char* kKeptAim = "0.98";     // of views promised to register, those that do
constexpr const char* kForeseenAim = "0.9";  // of views that register, those that were promised
constexpr double kPlanSeconds = 2;
constexpr size_t kAnywhere = 6;      // views of a scene, beside those that a plan names
constexpr double kAnywhereNear = 6;  // m, from the stations

struct Promises {
  size_t views = 0;
  size_t promised = 0;
  size_t registered = 0;
  size_t kept = 0;  // both
};

void ScanViews(const RepetitiveScene& scene, const PriorKind& kind, uint64_t seed,
               Promises& promises, parallel::Parallel& parallel) {
  RegistrationTrials trials(scene, seed, parallel);
  planning::PlanningConfig config;
  // What a session's plans do, too: a room that nobody has entered is promised by what is expected.
  config.station_basis = planning::StationBasis::kExpected;
  if (kind.stated == StatedPrior::kWithItsSigma) {
    config.registration.prior_sigma = kind.sigma;
    config.registration.prior_heading_sigma = RegistrationTrials::kTurnSigma;
  }
  const sensor::ScannerModel scanner;
  const auto problem =
      planning::PlanningProblem::Prepare({trials.view(), scanner, config}, parallel).value();
  const planning::Plan plan = planning::MakePlan(*problem, parallel::Budget::Seconds(kPlanSeconds),
                                                 parallel, [](const planning::Plan&) {});
  std::vector<planning::RankedView> views = plan.views;
  views.insert(views.end(), plan.refused.begin(), plan.refused.end());
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 76);
  const Vector3d middle = scene.scanned.front();
  const size_t wanted = views.size() + kAnywhere;
  for (int tries = 0; tries < 300 && views.size() < wanted; ++tries) {
    const Vector3d at = middle + Vector3d(random.Between(-kAnywhereNear, kAnywhereNear),
                                          random.Between(-kAnywhereNear, kAnywhereNear), 0);
    auto evaluated = planning::EvaluateView(*problem, at).value();
    if (evaluated.feasible) views.push_back(evaluated.view);
  }
  for (const planning::RankedView& view : views) {
    const bool promised = view.verdict.registered();
    const bool registered =
        trials.Register(view.position, kind.sigma, kind.stated, {}).result.verdict.registered();
    ++promises.views;
    promises.promised += promised ? 1 : 0;
    promises.registered += registered ? 1 : 0;
    promises.kept += promised && registered ? 1 : 0;
  }
}

double Share(size_t part, size_t of) {
  return of > 0 ? static_cast<double>(part) / static_cast<double>(of) : 1.0;
}

}  // namespace

void BenchPrediction(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const auto wants = [&](const std::string& of) {
    return figures.Wants(absl::StrCat("predict.kept.", of)) ||
           figures.Wants(absl::StrCat("predict.missed.", of));
  };
  if (!wants("")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 12 : 3;
  using Make = RepetitiveScene (*)(uint64_t);
  constexpr std::array<std::pair<const char*, Make>, 6> kKinds = {{
      {"flats", [](uint64_t s) { return AroundStart(simulation::FurnishedFlat(s), s); }},
      {"offices", [](uint64_t s) { return AroundStart(simulation::OfficeStorey(s, 150), s); }},
      {"doors", DoorCorridor},
      {"pillars", [](uint64_t s) { return PillarCorridor(s, 0); }},
      {"marked", [](uint64_t s) { return PillarCorridor(s, 6); }},
      {"decks", ParkingDeck},
  }};
  for (const auto& [name, make] : kKinds) {
    for (const PriorKind& kind : kPriorKinds) {
      const std::string of = absl::StrCat(name, ".", kind.name);
      if (!wants(of)) continue;
      Promises promises;
      for (uint64_t seed = first; seed < first + scenes; ++seed) {
        ScanViews(make(seed), kind, seed, promises, parallel);
      }
      const double kept = Share(promises.kept, promises.promised);
      const double foreseen = Share(promises.kept, promises.registered);
      figures.Add(
          {absl::StrCat("predict.kept.", of), kept, "", kKeptAim,
           absl::StrFormat("of %d views promised to register; %.2f promised of those that do",
                           promises.promised, foreseen)});
      figures.Add({absl::StrCat("predict.missed.", of), foreseen, "", kForeseenAim,
                   absl::StrFormat("promised, of %d of %d views that registered; %.2f kept",
                                   promises.registered, promises.views, kept)});
    }
  }
}

}  // namespace vantage::bench
