#include "client/simulated_job/walk_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "core/simulation/standable_positions.h"

namespace vantage::simulated_job {
namespace {

constexpr double kStep = 0.1;        // m
constexpr double kRadius = 0.3;      // m
constexpr double kHeight = 1.5;      // m over the floor
constexpr double kTallest = 2.0;     // m: no viewpoint is higher over its floor
constexpr double kOtherFloor = 1e4;  // m^2 in plan for a metre more: never, if there is another
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

WalkMap::WalkMap(const simulation::SimulatedScanner& tracer, const Site& site)
    : origin_(site.mesh.Bounds().min().head<2>()) {
  if (site.several_levels) {
    FromGround(simulation::WalkableGround(tracer, site.mesh.Bounds(), site.start));
  } else {
    FromOneFloor(tracer, site);
  }
}

std::pair<int, int> WalkMap::CellOf(const Eigen::Vector3d& at) const {
  const Eigen::Vector2i cell =
      ((at.head<2>() - origin_) / kStep).array().round().cast<int>().matrix();
  return {cell.x(), cell.y()};
}

void WalkMap::Add(const Eigen::Vector3d& at) {
  index_[CellOf(at)].push_back(static_cast<int>(places_.size()));
  places_.push_back({at, {}});
}

void WalkMap::FromOneFloor(const simulation::SimulatedScanner& tracer, const Site& site) {
  Eigen::Vector3d start = site.start;
  start.z() = site.floor_height + kHeight;
  for (const Eigen::Vector3d& place : simulation::StandablePositions(
           tracer, site.mesh.Bounds(), start, site.floor_height, kHeight, kRadius, kStep)) {
    Add({place.x(), place.y(), site.floor_height});
  }
  for (Place& place : places_) {
    const auto [x, y] = CellOf(place.at);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const auto next = index_.find({x + dx, y + dy});
        if (next != index_.end()) place.around.push_back(next->second.front());
      }
    }
  }
}

void WalkMap::FromGround(const simulation::WalkableGround& ground) {
  for (size_t i = 0; i < ground.places().size(); ++i) {
    Add(ground.At(i));
    for (const size_t next : ground.Around(i)) places_[i].around.push_back(static_cast<int>(next));
  }
}

int WalkMap::Nearest(const Eigen::Vector3d& place) const {
  int best = -1;
  double least = kNever;
  const auto consider = [&](int i) {
    const Eigen::Vector3d off = place - places_[static_cast<size_t>(i)].at;
    // The floor below the place, not one above it, nor one that lies under that floor.
    const double wrong = off.z() < -kStep ? -off.z() : std::max(0.0, off.z() - kTallest);
    const double distance = off.head<2>().squaredNorm() + kOtherFloor * wrong;
    if (distance < least) {
      least = distance;
      best = i;
    }
  };
  if (const auto here = index_.find(CellOf(place)); here != index_.end()) {
    for (const int i : here->second) consider(i);
    if (least < kOtherFloor * kStep) return best;
  }
  for (size_t i = 0; i < places_.size(); ++i) consider(static_cast<int>(i));
  return best;
}

WalkMap::Ways WalkMap::From(const Eigen::Vector3d& from) const {
  Ways ways{std::vector<double>(places_.size(), kNever), std::vector<int>(places_.size(), -1)};
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  const int first = Nearest(from);
  if (first >= 0) {
    ways.length[static_cast<size_t>(first)] = 0;
    front.emplace(0.0, first);
  }
  while (!front.empty()) {
    const auto [distance, at] = front.top();
    front.pop();
    if (distance > ways.length[static_cast<size_t>(at)]) continue;
    const Place& place = places_[static_cast<size_t>(at)];
    for (const int next : place.around) {
      const double there = distance + (places_[static_cast<size_t>(next)].at - place.at).norm();
      if (there >= ways.length[static_cast<size_t>(next)]) continue;
      ways.length[static_cast<size_t>(next)] = there;
      ways.before[static_cast<size_t>(next)] = at;
      front.emplace(there, next);
    }
  }
  return ways;
}

std::vector<double> WalkMap::Distances(const Eigen::Vector3d& from,
                                       const std::vector<Eigen::Vector3d>& to) const {
  const Ways ways = From(from);
  std::vector<double> distances;
  for (const Eigen::Vector3d& place : to) {
    const double straight = (place - from).head<2>().norm();
    const int last = Nearest(place);
    const double around = last < 0 ? kNever : ways.length[static_cast<size_t>(last)];
    distances.push_back(around < kNever ? std::max(around, straight) : straight);
  }
  return distances;
}

std::vector<Eigen::Vector2d> WalkMap::Way(const Eigen::Vector3d& from,
                                          const Eigen::Vector3d& to) const {
  const Ways ways = From(from);
  std::vector<Eigen::Vector2d> way = {to.head<2>()};
  const int last = Nearest(to);
  if (last >= 0 && ways.length[static_cast<size_t>(last)] < kNever) {
    for (int at = last; at >= 0; at = ways.before[static_cast<size_t>(at)]) {
      way.emplace_back(places_[static_cast<size_t>(at)].at.head<2>());
    }
  }
  way.emplace_back(from.head<2>());
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace vantage::simulated_job
