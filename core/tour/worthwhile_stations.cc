#include "core/tour/worthwhile_stations.h"

#include <algorithm>
#include <utility>

#include "core/cover/bonds.h"
#include "core/cover/element_set.h"

namespace vantage::tour {
namespace {

double Area(const cover::CoverProblem& cover, const cover::ElementSet& covered) {
  double area = 0;
  cover::ForEach(covered, [&](size_t i) { area += cover.weights[i]; });
  return area;
}

double AreaOf(const cover::CoverProblem& cover, const std::vector<uint32_t>& stations) {
  cover::ElementSet covered = cover::EmptySet(cover.weights.size());
  for (const uint32_t station : stations) cover::Unite(covered, cover.covers[station]);
  return Area(cover, covered);
}

bool AreLinked(const cover::CoverProblem& cover, uint32_t a, uint32_t b) {
  return std::binary_search(cover.links[a].begin(), cover.links[a].end(), b);
}

// Moves the stations that hang together with those in `part` out of `left` into it.
void Gather(const cover::CoverProblem& cover, std::vector<uint32_t>& part,
            std::vector<uint32_t>& left) {
  for (size_t head = 0; head < part.size(); ++head) {
    const auto linked = [&](uint32_t other) { return AreLinked(cover, part[head], other); };
    const auto rest = std::stable_partition(left.begin(), left.end(),
                                            [&](uint32_t other) { return !linked(other); });
    const std::vector<uint32_t> found(rest, left.end());
    left.erase(rest, left.end());
    part.insert(part.end(), found.begin(), found.end());
  }
}

}  // namespace

std::vector<double> OwnAreas(const cover::CoverProblem& cover,
                             const std::vector<uint32_t>& stations) {
  cover::ElementSet once = cover::EmptySet(cover.weights.size());
  cover::ElementSet twice = once;
  for (const uint32_t station : stations) {
    for (size_t w = 0; w < once.size(); ++w) twice[w] |= once[w] & cover.covers[station][w];
    cover::Unite(once, cover.covers[station]);
  }
  std::vector<double> areas;
  areas.reserve(stations.size());
  for (const uint32_t station : stations) {
    cover::ElementSet own = cover.covers[station];
    cover::Subtract(own, twice);
    areas.push_back(Area(cover, own));
  }
  return areas;
}

size_t LeaveOutWhatIsNotWorthIt(const cover::CoverProblem& cover, double worth, double goal,
                                const parallel::Budget& budget, std::vector<uint32_t>& stations) {
  size_t left_out = 0;
  double area = AreaOf(cover, stations);
  while (!budget.Expired()) {
    const std::vector<double> areas = OwnAreas(cover, stations);
    std::vector<std::pair<double, size_t>> losses;
    for (size_t k = 0; k < stations.size(); ++k) {
      if (areas[k] < worth && area - areas[k] >= goal) losses.emplace_back(areas[k], k);
    }
    std::sort(losses.begin(), losses.end());
    const auto without = [&](size_t k) {
      std::vector<uint32_t> others = stations;
      others.erase(others.begin() + static_cast<ptrdiff_t>(k));
      return others;
    };
    const auto leaves = std::find_if(losses.begin(), losses.end(), [&](const auto& loss) {
      return cover::HangTogether(cover, without(loss.second));
    });
    if (leaves == losses.end()) break;
    stations = without(leaves->second);
    area -= leaves->first;
    ++left_out;
  }
  return left_out;
}

std::vector<uint32_t> PartThatHangsTogether(const cover::CoverProblem& cover,
                                            const std::vector<uint32_t>& stations) {
  std::vector<uint32_t> left = stations;
  std::vector<uint32_t> best;
  if (!cover.anchored.empty()) {
    const auto others = std::stable_partition(left.begin(), left.end(), [&](uint32_t station) {
      return std::binary_search(cover.anchored.begin(), cover.anchored.end(), station);
    });
    best.assign(left.begin(), others);
    left.erase(left.begin(), others);
    Gather(cover, best, left);
  }
  double most = 0;
  while (cover.anchored.empty() && !left.empty()) {
    std::vector<uint32_t> part = {left.front()};
    left.erase(left.begin());
    Gather(cover, part, left);
    const double area = AreaOf(cover, part);
    if (!best.empty() && area <= most) continue;
    most = area;
    best = std::move(part);
  }
  std::vector<uint32_t> in_order;
  for (const uint32_t station : stations) {
    if (std::find(best.begin(), best.end(), station) != best.end()) in_order.push_back(station);
  }
  return in_order;
}

std::vector<uint32_t> StationsToKeep(const cover::CoverProblem& cover,
                                     const std::vector<uint32_t>& stations, double worth,
                                     const parallel::Budget& budget) {
  std::vector<uint32_t> kept = PartThatHangsTogether(cover, stations);
  LeaveOutWhatIsNotWorthIt(cover, worth, 0, budget, kept);
  return kept;
}

}  // namespace vantage::tour
