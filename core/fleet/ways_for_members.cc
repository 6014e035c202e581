#include "core/fleet/ways_for_members.h"

#include <algorithm>

#include "core/planning/ranking/narrow_ways.h"

namespace vantage::fleet {
namespace {

// m: ways whose narrowest places lie this near are one, which scanners that differ may find a
// viewcell apart.
constexpr double kSameWay = 0.5;

// Where the scanners of a class may stand, one or another of them; none: everywhere.
std::vector<planning::Region> ReachOf(size_t of, std::span<const ClassedMember> members) {
  std::vector<planning::Region> reach;
  for (const ClassedMember& member : members) {
    if (member.of != of) continue;
    const std::vector<planning::Region>& own = member.routes.member().reach;
    if (own.empty()) return {};
    reach.insert(reach.end(), own.begin(), own.end());
  }
  return reach;
}

}  // namespace

std::vector<planning::NarrowWay> WaysForMembers(std::span<const ScannerClass> classes,
                                                std::span<const ClassedMember> members,
                                                const planning::CellArrays& left, double best,
                                                uint64_t done, const parallel::Budget& budget,
                                                parallel::Parallel& parallel) {
  std::vector<planning::NarrowWay> all;
  for (size_t of = 0; of < classes.size(); ++of) {
    const std::vector<planning::Region> reach = ReachOf(of, members);
    const planning::NarrowWays own =
        planning::FindNarrowWays({*classes[of].problem, left, best, reach}, done, budget, parallel);
    done += own.rays;
    all.insert(all.end(), own.ways.begin(), own.ways.end());
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const planning::NarrowWay& a, const planning::NarrowWay& b) {
                     return a.gain_without_hidden > b.gain_without_hidden;
                   });
  if (classes.size() == 1) return all;
  std::vector<planning::NarrowWay> ways;
  for (const planning::NarrowWay& way : all) {
    const bool known = std::any_of(ways.begin(), ways.end(), [&](const planning::NarrowWay& other) {
      return (other.narrowest - way.narrowest).norm() < kSameWay;
    });
    if (!known) ways.push_back(way);
  }
  return ways;
}

}  // namespace vantage::fleet
