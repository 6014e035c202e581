#include "core/registration/sightings.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/container/btree_map.h"

namespace vantage::registration {
namespace {

constexpr double kSigmasOfBound = 1.96;  // the bound of a pose holds at 95 %
constexpr double kMostSigma = 1;         // m, that ties may have: their own limit

struct KnownPlace {
  Eigen::Vector3d place;
  double sigma;  // m, in addition to that of the sighting
};

// By name; of several the one with the best known pose, the first of equals.
absl::btree_map<std::string, KnownPlace> PlacesSeen(std::span<const SightingsOfScan> before) {
  absl::btree_map<std::string, KnownPlace> known;
  for (const SightingsOfScan& scan : before) {
    for (const Sighting& target : scan.targets) {
      const KnownPlace here{scan.T_world_scan * target.in_scan, scan.error_bound / kSigmasOfBound};
      const auto [it, fresh] = known.try_emplace(target.name, here);
      if (!fresh && here.sigma < it->second.sigma) it->second = here;
    }
  }
  return known;
}

}  // namespace

std::vector<KnownTarget> KnownTargetsOf(std::span<const SightingsOfScan> before) {
  absl::btree_map<std::string, KnownPlace> places = PlacesSeen(before);
  for (const SightingsOfScan& scan : before) {
    for (const Sighting& target : scan.targets) {
      if (target.in_world.has_value()) places[target.name] = {*target.in_world, 0};
    }
  }
  std::vector<KnownTarget> known;
  for (const auto& [name, place] : places) {
    KnownTarget& target = known.emplace_back();
    target.name = name;
    target.in_world = place.place;
    target.sigma = std::min(kMostSigma, std::hypot(target.sigma, place.sigma));
  }
  return known;
}

std::vector<TargetTie> TiesOf(std::span<const Sighting> sighted,
                              std::span<const SightingsOfScan> before) {
  const absl::btree_map<std::string, KnownPlace> known = PlacesSeen(before);
  std::vector<TargetTie> ties;
  for (const Sighting& target : sighted) {
    TargetTie tie;
    tie.name = target.name;
    tie.in_scan = target.in_scan;
    tie.sigma = target.sigma.value_or(tie.sigma);
    if (target.in_world.has_value()) {
      tie.in_world = *target.in_world;
    } else if (const auto it = known.find(tie.name); it != known.end()) {
      tie.in_world = it->second.place;
      tie.sigma = std::min(kMostSigma, std::hypot(tie.sigma, it->second.sigma));
    } else {
      continue;
    }
    ties.push_back(std::move(tie));
  }
  return ties;
}

}  // namespace vantage::registration
