#include "client/simulated_job/walk_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "core/simulation/standable_positions.h"

namespace vantage::simulated_job {
namespace {

constexpr double kStep = 0.1;    // m
constexpr double kRadius = 0.3;  // m
constexpr double kHeight = 1.5;  // m over the floor
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

WalkMap::WalkMap(const simulation::SimulatedScanner& tracer, const Site& site) {
  const Eigen::AlignedBox3d bounds = site.mesh.Bounds();
  Eigen::Vector3d start = site.start;
  start.z() = site.floor_height + kHeight;
  origin_ = bounds.min().head<2>();
  columns_ = static_cast<int>(bounds.sizes().x() / kStep) + 1;
  rows_ = static_cast<int>(bounds.sizes().y() / kStep) + 1;
  index_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), -1);
  for (const Eigen::Vector3d& place : simulation::StandablePositions(
           tracer, bounds, start, site.floor_height, kHeight, kRadius, kStep)) {
    const Eigen::Vector2i cell =
        ((place.head<2>() - origin_) / kStep).array().round().cast<int>().matrix();
    index_[static_cast<size_t>(cell.y() * columns_ + cell.x())] = static_cast<int>(places_.size());
    places_.emplace_back(place.head<2>());
  }
}

int WalkMap::Nearest(const Eigen::Vector3d& place) const {
  const Eigen::Vector2i cell =
      ((place.head<2>() - origin_) / kStep).array().round().cast<int>().matrix();
  if ((cell.array() >= 0).all() && cell.x() < columns_ && cell.y() < rows_) {
    const int there = index_[static_cast<size_t>(cell.y() * columns_ + cell.x())];
    if (there >= 0) return there;
  }
  int best = -1;
  double least = kNever;
  for (size_t i = 0; i < places_.size(); ++i) {
    const double distance = (places_[i] - place.head<2>()).squaredNorm();
    if (distance < least) {
      least = distance;
      best = static_cast<int>(i);
    }
  }
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
    const Eigen::Vector2i cell =
        ((places_[static_cast<size_t>(at)] - origin_) / kStep).array().round().cast<int>().matrix();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int x = cell.x() + dx;
        const int y = cell.y() + dy;
        if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
        const int next = index_[static_cast<size_t>(y * columns_ + x)];
        if (next < 0) continue;
        const double there = distance + kStep * std::sqrt(static_cast<double>(dx * dx + dy * dy));
        if (there >= ways.length[static_cast<size_t>(next)]) continue;
        ways.length[static_cast<size_t>(next)] = there;
        ways.before[static_cast<size_t>(next)] = at;
        front.emplace(there, next);
      }
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
      way.push_back(places_[static_cast<size_t>(at)]);
    }
  }
  way.emplace_back(from.head<2>());
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace vantage::simulated_job
