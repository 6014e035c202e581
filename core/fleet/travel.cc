#include "core/fleet/travel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "core/planning/feasibility/floor_heights.h"

namespace vantage::fleet {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr size_t kColumnsBetweenPolls = 1024;

// The search for ways over a grid of columns.
class Search {
 public:
  Search(const WalkGrid& grid, std::vector<float>& length, std::vector<uint32_t>& parent)
      : grid_(grid), length_(length), parent_(parent), done_(length.size(), 0) {}

  void From(uint32_t start, const parallel::Budget& budget) {
    using Entry = std::pair<float, uint32_t>;  // length so far (m), column
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    start_ = start;
    length_[start] = 0;
    parent_[start] = start;
    queue.emplace(0.0f, start);
    size_t until_poll = kColumnsBetweenPolls;
    while (!queue.empty()) {
      if (until_poll-- == 0) {
        if (budget.Expired()) return Forget();
        until_poll = kColumnsBetweenPolls;
      }
      const float so_far = queue.top().first;
      const uint32_t at = queue.top().second;
      queue.pop();
      if (done_[at] != 0 || so_far > length_[at]) continue;
      if (!SetVertex(at)) {  // the straight way is blocked, so the way is longer than assumed
        queue.emplace(length_[at], at);
        continue;
      }
      done_[at] = 1;
      ForNeighbours(at, [&](uint32_t to) {
        if (done_[to] != 0) return;
        // The straight way from the previous corner is assumed to be free; SetVertex() checks.
        const uint32_t corner = parent_[at];
        const float length = length_[corner] + Distance(corner, to);
        if (length >= length_[to]) return;
        length_[to] = length;
        parent_[to] = corner;
        queue.emplace(length, to);
      });
    }
  }

 private:
  Eigen::Vector2i At(uint32_t i) const {
    return {static_cast<int>(i) % grid_.size.x(), static_cast<int>(i) / grid_.size.x()};
  }
  float Distance(uint32_t a, uint32_t b) const {
    return static_cast<float>(grid_.cell_size * (At(a) - At(b)).cast<double>().norm());
  }
  bool Passable(uint32_t i) const { return i == start_ || grid_.passable[i] != 0; }
  // The way between two neighbouring columns.
  bool Step(uint32_t from, uint32_t to) const {
    return Passable(to) &&
           std::abs(grid_.floor[to] - grid_.floor[from]) <= planning::FloorHeights::kMaxStep;
  }
  template <typename Visit>
  void ForNeighbours(uint32_t at, Visit visit) const {
    const Eigen::Vector2i c = At(at);
    for (int y = std::max(0, c.y() - 1); y <= std::min(grid_.size.y() - 1, c.y() + 1); ++y) {
      for (int x = std::max(0, c.x() - 1); x <= std::min(grid_.size.x() - 1, c.x() + 1); ++x) {
        const auto to = static_cast<uint32_t>(x + grid_.size.x() * y);
        if (to != at && Step(at, to)) visit(to);
      }
    }
  }

  // True when every column on the straight line between two centres is passable.
  bool LineOfSight(uint32_t a, uint32_t b) const {
    const Eigen::Vector2i from = At(a);
    const Eigen::Vector2i to = At(b);
    const Eigen::Vector2i delta = (to - from).cwiseAbs();
    const Eigen::Vector2i sign = (to - from).cwiseSign();
    Eigen::Vector2i at = from;
    Eigen::Vector2i steps = Eigen::Vector2i::Zero();
    uint32_t here = a;
    while (at != to) {
      // Which side of the column is crossed next: compares (2 steps + 1) / delta of both axes.
      const int64_t side =
          int64_t{2 * steps.x() + 1} * delta.y() - int64_t{2 * steps.y() + 1} * delta.x();
      const bool along_x = side <= 0 && steps.x() < delta.x();
      const bool along_y = side >= 0 && steps.y() < delta.y();
      if (along_x) {
        at.x() += sign.x();
        ++steps.x();
      }
      if (along_y) {
        at.y() += sign.y();
        ++steps.y();
      }
      const auto next = static_cast<uint32_t>(at.x() + grid_.size.x() * at.y());
      if (!Step(here, next)) return false;
      here = next;
    }
    return true;
  }

  // Checks the way to a column that is about to become final. False when it became longer.
  bool SetVertex(uint32_t at) {
    if (LineOfSight(parent_[at], at)) return true;
    const float before = length_[at];
    length_[at] = kFar;
    ForNeighbours(at, [&](uint32_t from) {
      if (done_[from] == 0) return;
      const float length = length_[from] + Distance(from, at);
      if (length >= length_[at]) return;
      length_[at] = length;
      parent_[at] = from;
    });
    return length_[at] <= before;
  }

  void Forget() {
    for (size_t i = 0; i < length_.size(); ++i) {
      if (done_[i] == 0) length_[i] = kFar;
    }
  }

  const WalkGrid& grid_;
  std::vector<float>& length_;
  std::vector<uint32_t>& parent_;
  std::vector<uint8_t> done_;
  uint32_t start_ = 0;
};

}  // namespace

WalkGrid WalkGridOf(const planning::FeasibleViews& feasible,
                    std::span<const Eigen::AlignedBox3d> reach) {
  const planning::ReachMap& map = feasible.reach();
  WalkGrid grid;
  grid.first = map.first();
  grid.size = map.size();
  grid.cell_size = feasible.cell_size();
  const size_t columns = static_cast<size_t>(grid.size.x()) * static_cast<size_t>(grid.size.y());
  grid.passable.assign(columns, 0);
  grid.floor.assign(columns, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < grid.size.y(); ++y) {
    for (int x = 0; x < grid.size.x(); ++x) {
      const Eigen::Vector2i c = grid.first + Eigen::Vector2i(x, y);
      const Eigen::Vector2d centre = (c.cast<double>().array() + 0.5) * grid.cell_size;
      const bool within =
          reach.empty() || std::any_of(reach.begin(), reach.end(), [&](const auto& box) {
            return (centre.array() >= box.min().template head<2>().array()).all() &&
                   (centre.array() <= box.max().template head<2>().array()).all();
          });
      grid.floor[grid.Index(c)] = map.Floor(c.x(), c.y());
      grid.passable[grid.Index(c)] = static_cast<uint8_t>(within && map.Passable(c.x(), c.y()));
    }
  }
  return grid;
}

TravelMap::TravelMap(const WalkGrid& grid, const Eigen::Vector3d& from,
                     const parallel::Budget& budget)
    : grid_(grid), from_(from) {
  const Eigen::Vector2i start = grid.ColumnOf(from);
  if (!grid.Inside(start)) return;
  const size_t at = grid.Index(start);
  if (std::isnan(grid_.floor[at])) {
    // A scanner stands on a floor: that of the nearest column that has one.
    for (int y = start.y() - 1; y <= start.y() + 1; ++y) {
      for (int x = start.x() - 1; x <= start.x() + 1; ++x) {
        if (!grid.Inside({x, y}) || std::isnan(grid.floor[grid.Index({x, y})])) continue;
        grid_.floor[at] = grid.floor[grid.Index({x, y})];
      }
    }
  }
  length_.assign(grid.passable.size(), kFar);
  parent_.assign(grid.passable.size(), 0);
  Search(grid_, length_, parent_).From(static_cast<uint32_t>(at), budget);
}

std::optional<double> TravelMap::Length(const Eigen::Vector3d& to) const {
  if (!known()) return std::nullopt;
  const Eigen::Vector2i column = grid_.ColumnOf(to);
  if (!grid_.Inside(column)) return std::nullopt;
  const float length = length_[grid_.Index(column)];
  if (length == kFar) return std::nullopt;
  return length;
}

std::vector<Eigen::Vector3d> TravelMap::Way(const Eigen::Vector3d& to) const {
  std::vector<Eigen::Vector3d> way;
  if (!Length(to).has_value()) return way;
  const auto point = [&](size_t i) {
    const int x = static_cast<int>(i % static_cast<size_t>(grid_.size.x()));
    const int y = static_cast<int>(i / static_cast<size_t>(grid_.size.x()));
    return Eigen::Vector3d((grid_.first.x() + x + 0.5) * grid_.cell_size,
                           (grid_.first.y() + y + 0.5) * grid_.cell_size,
                           static_cast<double>(grid_.floor[i]));
  };
  const size_t start = grid_.Index(grid_.ColumnOf(from_));
  for (size_t at = grid_.Index(grid_.ColumnOf(to));; at = parent_[at]) {
    way.push_back(point(at));
    if (at == start) break;
  }
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace vantage::fleet
