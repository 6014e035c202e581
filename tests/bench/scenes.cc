#include "tests/bench/scenes.h"

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::bench {
namespace {

constexpr uint64_t kTuningSeed = 1;
constexpr std::array<uint64_t, 3> kReportingSeeds = {201, 202, 203};
static_assert(simulation::UseOfSeed(kTuningSeed) == SceneUse::kTuning);
static_assert(simulation::UseOfSeed(kReportingSeeds.front()) == SceneUse::kReporting);

// `make(seed, parallel)` for all seeds of a use.
template <typename Make>
PlanningKind Generated(std::string kind, const std::string& scene, SceneUse use, Make make) {
  const auto of = [&](uint64_t seed) {
    return PlanningScene{
        absl::StrCat(scene, "-", seed),
        [make, seed](parallel::Parallel& parallel) { return make(seed, parallel); }};
  };
  PlanningKind made{std::move(kind), of(kTuningSeed), {}};
  for (const uint64_t seed : SceneSeeds(use)) made.measured.push_back(of(seed));
  return made;
}

}  // namespace

std::vector<uint64_t> SceneSeeds(SceneUse use) {
  if (use == SceneUse::kTuning) return {kTuningSeed};
  return {kReportingSeeds.begin(), kReportingSeeds.end()};
}

PlanningKind FlatsAfter(size_t scans, SceneUse use) {
  return Generated(absl::StrCat("flat", scans), "flat", use,
                   [scans](uint64_t seed, parallel::Parallel& parallel) {
                     return FlatPlanningJob(seed, scans, parallel);
                   });
}

PlanningKind RoomsAfter(size_t scans, SceneUse use) {
  return Generated(absl::StrCat("rooms", scans), "two-rooms", use,
                   [scans](uint64_t seed, parallel::Parallel& parallel) {
                     return RoomsPlanningJob(seed, scans, parallel);
                   });
}

PlanningKind HallsAfter(size_t scans, SceneUse use) {
  return Generated(absl::StrCat("hall", scans), "hall", use,
                   [scans](uint64_t seed, parallel::Parallel& parallel) {
                     return HallPlanningJob(seed, scans, parallel);
                   });
}

PlanningKind OfficeStoreys(double area_m2, SceneUse use) {
  return Generated(absl::StrCat(area_m2, "m2"), "office", use,
                   [area_m2](uint64_t seed, parallel::Parallel& parallel) {
                     return OfficePlanningJob(seed, area_m2, parallel);
                   });
}

PlanningKind Meshes(SceneUse use) {
  const auto of = [](const std::string& folder) {
    return PlanningScene{folder, [folder](parallel::Parallel& parallel) {
                           return MeshPlanningJob(folder, parallel);
                         }};
  };
  PlanningScene tuning = of("small_house");
  PlanningScene measured = use == SceneUse::kTuning ? tuning : of("bookstore");
  return {measured.name, std::move(tuning), {measured}};
}

}  // namespace vantage::bench
