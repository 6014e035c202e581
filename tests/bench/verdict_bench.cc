// Scans where a site repeats itself, with priors that may lead to the wrong bay: what is registered
// there, and how much is doubted where nothing repeats itself.
#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/bound/registration_result.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/registration_trials.h"
#include "tests/bench/repetitive_scenes.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

// m, one sigma of each horizontal axis, that priors state and have: a total station or a vendor's
// own registration, odometry, a spot on a plan, a spot on a plan of a bare building.
constexpr std::array kPriorSigmas = {0.05, 0.3, 1.0, 2.0};

// m, of a spot on a plan, where something changed.
constexpr double kChangePrior = 0.3;
constexpr double kElsewhere = 3;  // m

struct Tally {
  size_t scans = 0;
  size_t right = 0;
  size_t wrong = 0;  // registered more than three times its bound off
  size_t rival = 0;  // in doubt for another pose
  size_t refused = 0;
  std::string worst;
  void Add(const RegistrationTrial& trial) {
    const registration::RegistrationVerdict& verdict = trial.result.verdict;
    ++scans;
    if (!verdict.registered()) {
      const bool other =
          !verdict.bases.empty() && verdict.bases[0] == registration::RegistrationBasis::kRivalPose;
      ++(other ? rival : refused);
    } else if (trial.off > 3 * verdict.error_bound) {
      ++wrong;
      absl::StrAppendFormat(&worst, "; %.2f m off at E = %.1f mm", trial.off,
                            1000 * verdict.error_bound);
    } else {
      ++right;
    }
  }
  std::string Words() const {
    return absl::StrFormat("%d of %d right, %d wrong, %d another pose, %d else%s", right, scans,
                           wrong, rival, refused, worst);
  }
};

void RegisterIn(const RepetitiveScene& scene, double sigma, uint64_t seed, Tally& tally,
                parallel::Parallel& parallel) {
  RegistrationTrials trials(scene, seed, parallel);
  for (const Vector3d& place : scene.places) {
    const RegistrationTrial trial = trials.Register(place, sigma, StatedPrior::kWithItsSigma, {});
    tally.Add(trial);
  }
}

// Scans whose priors are of another of the scene's places, three metres and more away.
void RegisterElsewhere(const RepetitiveScene& scene, uint64_t seed, Tally& tally,
                       parallel::Parallel& parallel) {
  RegistrationTrials trials(scene, seed, parallel);
  for (const Vector3d& place : scene.places) {
    for (const Vector3d& told : scene.places) {
      if ((place - told).norm() < kElsewhere) continue;
      const RegistrationTrial trial =
          trials.RegisterFrom(place, told, kChangePrior, StatedPrior::kWithItsSigma, {});
      tally.Add(trial);
    }
  }
}

// Scans in flats and offices in which something changed since the model was made.
void RegisterAfter(Change change, const char* name, uint64_t first, uint64_t scenes,
                   Tally& wrong_places, Figures& figures, parallel::Parallel& parallel) {
  Tally tally;
  for (uint64_t seed = first; seed < first + scenes; ++seed) {
    RegisterIn(Changed(AroundStart(simulation::FurnishedFlat(seed), seed), change, seed),
               kChangePrior, seed, tally, parallel);
    RegisterIn(Changed(AroundStart(simulation::OfficeStorey(seed, 150), seed), change, seed),
               kChangePrior, seed, tally, parallel);
    RegisterIn(Changed(ParkingDeck(seed), change, seed), kChangePrior, seed, tally, parallel);
  }
  wrong_places.wrong += tally.wrong;
  figures.Add({absl::StrCat("change.recall.", name),
               static_cast<double>(tally.right) / static_cast<double>(tally.scans), "", "0.98",
               tally.Words()});
}

}  // namespace

void BenchChange(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("change.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 20 : 4;
  constexpr std::array<std::pair<const char*, Change>, 5> kChanges = {{
      {"people_came", Change::kPeopleCame},
      {"people_left", Change::kPeopleLeft},
      {"door", Change::kDoorShut},
      {"cupboard", Change::kCupboardMoved},
      {"car", Change::kCar},
  }};
  Tally wrong;
  for (const auto& [name, change] : kChanges) {
    if (!figures.Wants(absl::StrCat("change.recall.", name))) continue;
    RegisterAfter(change, name, first, scenes, wrong, figures, parallel);
  }
  if (!figures.Wants("change.wrong")) return;
  // What speaks against things that were moved is that a wrong pose contradicts, too: scans of
  // places that their priors do not allow.
  Tally elsewhere;
  for (uint64_t seed = first; seed < first + 2 * scenes; ++seed) {
    RegisterElsewhere(AroundStart(simulation::FurnishedFlat(seed), seed), seed, elsewhere,
                      parallel);
    RegisterElsewhere(AroundStart(simulation::OfficeStorey(seed, 150), seed), seed, elsewhere,
                      parallel);
  }
  figures.Add({"change.wrong", static_cast<double>(wrong.wrong + elsewhere.wrong), "scans", "0",
               absl::StrCat("from priors of other places: ", elsewhere.Words())});
}

void BenchVerdict(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("verdict.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 20 : 4;
  for (const double sigma : kPriorSigmas) {
    Tally repetitive;
    Tally marked;
    Tally decks;
    Tally unique;
    for (uint64_t seed = first; seed < first + scenes; ++seed) {
      RegisterIn(PillarCorridor(seed, 0), sigma, seed, repetitive, parallel);
      RegisterIn(PillarCorridor(seed, 6), sigma, seed, marked, parallel);
      RegisterIn(ParkingDeck(seed), sigma, seed, decks, parallel);
      RegisterIn(AroundStart(simulation::FurnishedFlat(seed), seed), sigma, seed, unique, parallel);
      RegisterIn(AroundStart(simulation::OfficeStorey(seed, 150), seed), sigma, seed, unique,
                 parallel);
    }
    const std::string name = absl::StrFormat("%gm", sigma);
    figures.Add({"verdict.wrong." + name,
                 static_cast<double>(repetitive.wrong + marked.wrong + decks.wrong + unique.wrong),
                 "scans", "0",
                 absl::StrCat("corridors: ", repetitive.Words(), "; with other things in them: ",
                              marked.Words(), "; parking decks: ", decks.Words())});
    figures.Add({"verdict.doubts." + name,
                 static_cast<double>(unique.rival) / static_cast<double>(unique.scans), "", "0.02",
                 absl::StrCat("flats and offices: ", unique.Words())});
  }
}

}  // namespace vantage::bench
