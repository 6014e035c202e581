#include "core/fleet/travel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

namespace vantage::fleet {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr uint32_t kNowhere = std::numeric_limits<uint32_t>::max();
constexpr size_t kColumnsBetweenPolls = 1024;

// Of the queue, the nearest first: the length so far (m), which is not below 0, and so sorts as its
// bits do, and the node.
uint64_t EntryOf(float length, uint32_t node) {
  return uint64_t{std::bit_cast<uint32_t>(length)} << 32 | node;
}

// The search for ways over the nodes of a grid.
class Search {
 public:
  Search(const WalkGrid& grid, std::vector<float>& length, std::vector<uint32_t>& parent)
      : grid_(grid), length_(length), parent_(parent), done_(length.size(), 0) {}

  // To all nodes, or until the way to `last` is known.
  void From(uint32_t start, std::optional<uint32_t> last, const parallel::Budget& budget) {
    std::priority_queue<uint64_t, std::vector<uint64_t>, std::greater<>> queue;
    start_ = start;
    length_[start] = 0;
    parent_[start] = start;
    queue.push(EntryOf(0, start));
    size_t until_poll = kColumnsBetweenPolls;
    while (!queue.empty()) {
      if (until_poll-- == 0) {
        if (budget.Expired()) return Forget();
        until_poll = kColumnsBetweenPolls;
      }
      const auto so_far = std::bit_cast<float>(static_cast<uint32_t>(queue.top() >> 32));
      const auto at = static_cast<uint32_t>(queue.top());
      queue.pop();
      if (done_[at] != 0 || so_far > length_[at]) continue;
      if (!SetVertex(at)) {  // the straight way is blocked, so the way is longer than assumed
        queue.push(EntryOf(length_[at], at));
        continue;
      }
      done_[at] = 1;
      if (at == last) return Forget();
      ForNeighbours(at, [&](uint32_t to) {
        if (done_[to] != 0) return;
        // The straight way from the previous corner is assumed to be free; SetVertex() checks.
        const uint32_t corner = parent_[at];
        const float length = length_[corner] + Distance(corner, to);
        if (length >= length_[to]) return;
        length_[to] = length;
        parent_[to] = corner;
        queue.push(EntryOf(length, to));
      });
    }
  }

 private:
  const Eigen::Vector2i& At(uint32_t i) const { return grid_.nodes.Column(i); }
  float Distance(uint32_t a, uint32_t b) const {
    return static_cast<float>(grid_.nodes.cell_size() * (At(a) - At(b)).cast<double>().norm());
  }
  bool Passable(uint32_t i) const { return i == start_ || grid_.passable[i] != 0; }
  template <typename Visit>
  void ForNeighbours(uint32_t at, Visit visit) const {
    grid_.nodes.ForEachStep(at, [&](uint32_t to) {
      if (Passable(to)) visit(to);
    });
  }
  // Where the way from a node goes on in a neighbouring column: to the floor nearest in height.
  // kNowhere: it does not.
  uint32_t Onward(uint32_t from, const Eigen::Vector2i& column) const {
    uint32_t nearest = kNowhere;
    const auto apart = [&](uint32_t node) {
      return std::abs(grid_.nodes.Height(node) - grid_.nodes.Height(from));
    };
    const auto [begin, end] = grid_.nodes.In(column);
    for (uint32_t to = begin; to < end; ++to) {
      if (!Passable(to) || !grid_.nodes.IsStep(from, to)) continue;
      if (nearest == kNowhere || apart(to) < apart(nearest)) nearest = to;
    }
    return nearest;
  }

  // True when the way along the straight line between two centres is passable.
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
      here = Onward(here, at);
      if (here == kNowhere) return false;
    }
    return here == b;
  }

  // Checks the way to a node that is about to become final. False when it became longer.
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
  WalkGrid grid{map.nodes(), std::vector<uint8_t>(map.nodes().count(), 0)};
  for (uint32_t node = 0; node < grid.passable.size(); ++node) {
    const Eigen::Vector2d centre =
        (grid.nodes.Column(node).cast<double>().array() + 0.5) * grid.nodes.cell_size();
    const bool within =
        reach.empty() || std::any_of(reach.begin(), reach.end(), [&](const auto& box) {
          return (centre.array() >= box.min().template head<2>().array()).all() &&
                 (centre.array() <= box.max().template head<2>().array()).all();
        });
    grid.passable[node] = static_cast<uint8_t>(within && map.Passable(node));
  }
  return grid;
}

TravelMap::TravelMap(const WalkGrid& grid, const Eigen::Vector3d& from,
                     const std::optional<Eigen::Vector3d>& to, const parallel::Budget& budget)
    : grid_(grid), start_(grid.nodes.Under(from)) {
  const Eigen::Vector2i column = grid.nodes.ColumnAt(from);
  if (!grid.nodes.Inside(column)) return;
  if (!start_.has_value()) {
    // A scanner stands on a floor: that of a neighbouring column that has one.
    std::optional<float> height;
    for (int y = column.y() - 1; y <= column.y() + 1; ++y) {
      for (int x = column.x() - 1; x <= column.x() + 1; ++x) {
        const Eigen::Vector3d beside((x + 0.5) * grid.nodes.cell_size(),
                                     (y + 0.5) * grid.nodes.cell_size(), from.z());
        if (const auto node = grid.nodes.Under(beside); node.has_value()) {
          height = grid.nodes.Height(*node);
        }
      }
    }
    // Without one the scanner has no way anywhere, and still is where it is.
    start_ = grid_.nodes.Insert(column, height.value_or(static_cast<float>(from.z())));
    grid_.passable.insert(grid_.passable.begin() + *start_, 0);
  }
  length_.assign(grid_.passable.size(), kFar);
  parent_.assign(grid_.passable.size(), 0);
  const std::optional<uint32_t> last = to.has_value() ? grid_.nodes.Under(*to) : std::nullopt;
  if (to.has_value() && !last.has_value()) return;  // nothing to look for
  Search(grid_, length_, parent_).From(*start_, last, budget);
}

std::optional<double> TravelMap::Length(const Eigen::Vector3d& to) const {
  if (!known()) return std::nullopt;
  const std::optional<uint32_t> node = grid_.nodes.Under(to);
  if (!node.has_value() || length_[*node] == kFar) return std::nullopt;
  return length_[*node];
}

std::vector<Eigen::Vector3d> TravelMap::Way(const Eigen::Vector3d& to) const {
  std::vector<Eigen::Vector3d> way;
  if (!Length(to).has_value()) return way;
  for (uint32_t at = *grid_.nodes.Under(to);; at = parent_[at]) {
    const Eigen::Vector2d centre =
        (grid_.nodes.Column(at).cast<double>().array() + 0.5) * grid_.nodes.cell_size();
    way.emplace_back(centre.x(), centre.y(), static_cast<double>(grid_.nodes.Height(at)));
    if (at == *start_) break;
  }
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace vantage::fleet
