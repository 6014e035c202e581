#include "core/planning/feasibility/reach_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "absl/status/status.h"
#include "core/planning/feasibility/raised_stations.h"

namespace vantage::planning {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

constexpr double kNeedles = 1.0;  // m, around a station

constexpr double kTripod = 0.75;  // m, around a station

constexpr double kHanging = 0.5;  // m, over known-empty space

constexpr double kOwnFloor = 0.5;  // m that the floor around a station is higher or lower at most

// True when nothing in the voxel column [low, high) blocks the way to a station `away` metres off.
// Somebody carried the scanner in there, so what lay outside its field of view does not block;
// nearer, nothing that is merely unknown does; right beside the station not even measured surface
// does (the tripod's legs, the scanner's own body at the edge of its blind zone).
bool OnTheWayIn(const model::PlanningView& model, int x, int y, int low, int high, double away) {
  for (int z = low; z < high; ++z) {
    const model::VoxelState state = model.State({x, y, z});
    if (state == model::VoxelState::kEmpty || state == model::VoxelState::kUnknown ||
        state == model::VoxelState::kFalseImage || (away <= kNeedles && IsFalseSurface(state)) ||
        away <= kTripod) {
      continue;
    }
    return false;
  }
  return true;
}

// True when the scanner can be carried through a voxel column [low, high). Whatever stands on the
// floor blocks, and so does all measured surface. Unknown space half a metre over known-empty space
// does not: rays to a window crossed it, or it is an edge's shadow.
bool FreeToPass(const model::PlanningView& model, const visibility::OpaqueGrid& grid, int x, int y,
                int low, int high) {
  const int hanging = low + static_cast<int>(std::ceil(kHanging / model.voxel_size()));
  for (int z = low; z < high; ++z) {
    if (grid.Empty({x, y, z})) continue;
    const model::VoxelState state = model.State({x, y, z});
    const bool measured =
        state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
    if (measured || z < hanging) return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<ReachMap> ReachMap::Find(const model::PlanningView& model,
                                        const visibility::OpaqueGrid& grid, const FloorMap& floor,
                                        const PlanningConfig& config, const Eigen::Vector2i& first,
                                        const Eigen::Vector2i& size, int voxels_per_cell,
                                        parallel::Parallel& parallel,
                                        const parallel::Cancellation& cancelled) {
  ReachMap map;
  map.per_cell_ = voxels_per_cell;
  map.given_ = config.floor_z.has_value();
  map.nodes_ = FloorNodes(first, size, voxels_per_cell * model.voxel_size());
  map.AddNodes(floor.columns());
  // Nodes that are added move others, so all are there before any is kept.
  for (const model::Station& station : model.stations()) (void)map.NodeOf(station);
  map.FindPassable(model, grid, floor.columns(), config, parallel, cancelled);
  if (!cancelled.Requested()) map.Flood(model, cancelled);
  if (cancelled.Requested()) return absl::CancelledError("reachability");
  return map;
}

void ReachMap::AddNodes(const FloorColumns& floor) {
  const Eigen::Vector2i end = nodes_.first() + nodes_.size();
  std::vector<float> heights;
  for (int cy = nodes_.first().y(); cy < end.y(); ++cy) {
    for (int cx = nodes_.first().x(); cx < end.x(); ++cx) {
      heights.clear();
      for (const Floor& here : floor.At(Middle(cx), Middle(cy))) heights.push_back(here.height);
      nodes_.AddColumn(heights);
    }
  }
}

int ReachMap::Middle(int column) const {
  return static_cast<int>(std::floor((column + 0.5) * per_cell_));
}

void ReachMap::FindPassable(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                            const FloorColumns& floor, const PlanningConfig& config,
                            parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  const double voxel = model.voxel_size();
  const double radius = config.scanner_width / 2 / voxel;  // in voxels
  std::vector<uint8_t> free(floor.floors().size(), 0);     // by floor of a column of voxels
  struct Way {
    const model::Station& station;
    double floor;  // m, z
  };
  std::vector<Way> ways;
  for (const model::Station& station : model.stations()) {
    if (const auto node = NodeOf(station); node.has_value()) {
      ways.push_back({station, static_cast<double>(nodes_.Height(*node))});
    }
  }
  const auto fits_column = [&](uint32_t column) {
    const Eigen::Vector2i at = floor.Voxel(column);
    for (const Floor& here : floor.In(column)) {
      // The edge of a step that is hidden shows over where it is taken to lie.
      const double edge = here.source == FloorSource::kHidden ? kMaxStep : 0;
      const int low = FirstLayerOverFloor(here.height + static_cast<float>(edge), voxel);
      const int high = static_cast<int>(
          std::ceil((static_cast<double>(here.height) + config.scanner_height) / voxel - 1e-6));
      bool fits = FreeToPass(model, grid, at.x(), at.y(), low, high);
      for (const auto& [station, height] : ways) {
        if (fits) break;
        const double away =
            ((at.cast<double>().array() + 0.5) * voxel - station.position.head<2>().array())
                .matrix()
                .norm();
        // The way in was on the station's own floor or by stairs, not above it or below.
        const double aside = std::max(kOwnFloor, kMaxStep + kSteepestStairs * away);
        if (std::abs(height - static_cast<double>(here.height)) > aside) continue;
        fits = away <= 2 * (station.position.z() - static_cast<double>(here.height)) &&
               OnTheWayIn(model, at.x(), at.y(), low, high, away);
      }
      free[static_cast<size_t>(&here - floor.floors().data())] = fits;
    }
  };
  const auto row_length = static_cast<uint32_t>(floor.size().x());
  parallel.For(static_cast<size_t>(floor.size().y()), [&](size_t row) {
    if (cancelled.Requested()) return;
    for (uint32_t x = 0; x < row_length; ++x) {
      fits_column(static_cast<uint32_t>(row) * row_length + x);
    }
  });
  // Within its width the floor may rise and fall as stairs do.
  const auto fits = [&](int x, int y, float height, double away) {
    const double most = kMaxStep + kSteepestStairs * away * voxel;
    for (const Floor& here : floor.At(x, y)) {
      if (static_cast<double>(std::abs(here.height - height)) <= most &&
          free[static_cast<size_t>(&here - floor.floors().data())] != 0) {
        return true;
      }
    }
    return false;
  };
  // Columns of voxels under the scanner from its axis outwards: all nodes lie alike in theirs.
  struct Under {
    int x;
    int y;
    double away;  // of the nearest of it from the axis, in voxels
  };
  std::vector<Under> under;
  const double half = 0.5 * per_cell_ - std::floor(0.5 * per_cell_);
  const int reach = static_cast<int>(std::ceil(radius)) + 1;
  for (int y = -reach; y <= reach; ++y) {
    const double dy = std::max({0.0, y - half, half - (y + 1)});
    for (int x = -reach; x <= reach; ++x) {
      const double dx = std::max({0.0, x - half, half - (x + 1)});
      if (dx * dx + dy * dy >= radius * radius - 1e-9) continue;
      under.push_back({x, y, std::sqrt(dx * dx + dy * dy)});
    }
  }
  std::stable_sort(under.begin(), under.end(),
                   [](const Under& a, const Under& b) { return a.away < b.away; });
  width_ = static_cast<float>(config.scanner_width);
  clear_width_.assign(nodes_.count(), 0);
  parallel.For(static_cast<size_t>(nodes_.size().y()), [&](size_t row) {
    if (cancelled.Requested()) return;
    const int y = nodes_.first().y() + static_cast<int>(row);
    for (int x = nodes_.first().x(); x < nodes_.first().x() + nodes_.size().x(); ++x) {
      const Eigen::Vector2i middle(Middle(x), Middle(y));
      const auto [begin, end] = nodes_.In({x, y});
      for (uint32_t node = begin; node < end; ++node) {
        const auto wall = std::find_if(under.begin(), under.end(), [&](const Under& there) {
          return !fits(middle.x() + there.x, middle.y() + there.y, nodes_.Height(node), there.away);
        });
        clear_width_[node] =
            wall == under.end() ? width_ : static_cast<float>(2 * voxel * wall->away);
      }
    }
  });
}

// Adds a node where a station stands on a floor that is not known there. It stands on the highest
// floor below it, since nothing is between.
std::optional<uint32_t> ReachMap::NodeOf(const model::Station& station) {
  const Eigen::Vector2i column = nodes_.ColumnAt(station.position);
  if (!nodes_.Inside(column)) return std::nullopt;
  const std::optional<uint32_t> under = nodes_.Under(station.position);
  if (under.has_value() && (given_ || !station.floor_found)) return under;
  if (under.has_value()) {
    const auto height = static_cast<double>(nodes_.Height(*under));
    if (height <= station.position.z() && height >= station.floor_height - kOwnFloor) return under;
    // On stairs the scan took the floor at their head for its own, where it is known to be open.
    if (station.position.z() - height <= kHighestTripod) return under;
  }
  return nodes_.Insert(column, static_cast<float>(station.floor_height));
}

void ReachMap::Flood(const model::PlanningView& model, const parallel::Cancellation& cancelled) {
  using Entry = std::pair<float, uint32_t>;  // length so far (m), node
  const auto spread = [&](const std::vector<uint32_t>& seeds, std::vector<float>& distance) {
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (const uint32_t seed : seeds) {
      distance[seed] = 0;
      queue.emplace(0.0f, seed);
    }
    size_t until_poll = 0;
    while (!queue.empty()) {
      if (until_poll-- == 0) {
        if (cancelled.Requested()) return;
        until_poll = 4096;
      }
      const auto [so_far, at] = queue.top();
      queue.pop();
      if (so_far > distance[at]) continue;
      const Eigen::Vector2i from = nodes_.Column(at);
      nodes_.ForEachStep(at, [&, length_so_far = so_far](uint32_t to) {
        if (!Passable(to)) return;
        const Eigen::Vector2i way = (nodes_.Column(to) - from).cwiseAbs();
        const float length = static_cast<float>(nodes_.cell_size()) *
                             (way.sum() == 2 ? std::numbers::sqrt2_v<float> : 1.0f);
        if (length_so_far + length >= distance[to]) return;
        distance[to] = length_so_far + length;
        queue.emplace(distance[to], to);
      });
    }
  };
  // A station counts as reached even where the scanner does not seem to fit, since it stood there.
  std::vector<uint32_t> seeds;
  for (const model::Station& station : model.stations()) {
    if (const auto at = NodeOf(station); at.has_value()) seeds.push_back(*at);
  }
  std::vector<float> distance(nodes_.count(), kFar);
  spread(seeds, distance);
  reached_.assign(nodes_.count(), 0);
  travel_.assign(nodes_.count(), kFar);
  for (size_t at = 0; at < distance.size(); ++at) reached_[at] = distance[at] < kFar;
  if (model.stations().empty()) {
    ReachLargest();
    return;
  }
  if (const auto at = NodeOf(model.stations().back()); at.has_value()) spread({*at}, travel_);
}

// Before the first scan the scanner can be carried in somewhere: to where most of the site is
// reached from.
void ReachMap::ReachLargest() {
  std::vector<uint32_t> piece(nodes_.count(), 0);  // of those that hang together, from 1
  std::vector<uint32_t> front;
  uint32_t pieces = 0;
  uint32_t largest = 0;
  size_t most = 0;
  for (uint32_t start = 0; start < nodes_.count(); ++start) {
    if (piece[start] != 0 || !Passable(start)) continue;
    piece[start] = ++pieces;
    front.assign(1, start);
    for (size_t head = 0; head < front.size(); ++head) {
      nodes_.ForEachStep(front[head], [&](uint32_t to) {
        if (piece[to] != 0 || !Passable(to)) return;
        piece[to] = pieces;
        front.push_back(to);
      });
    }
    if (front.size() <= most) continue;
    most = front.size();
    largest = pieces;
  }
  for (uint32_t node = 0; node < nodes_.count(); ++node) {
    reached_[node] = largest != 0 && piece[node] == largest;
  }
}

std::vector<uint32_t> ReachMap::StationNodes(const model::PlanningView& model) const {
  std::vector<uint32_t> stations;
  for (const model::Station& station : model.stations()) {
    if (const auto node = nodes_.Under(station.position); node.has_value()) {
      stations.push_back(*node);
    }
  }
  return stations;
}

// The widest path problem: Dijkstra's algorithm with the least width in place of the sum of lengths
// (Pollack 1960).
std::vector<ReachMap::WidestWay> ReachMap::FindWidestWays(const model::PlanningView& model) const {
  std::vector<WidestWay> ways(nodes_.count());
  std::priority_queue<std::pair<float, uint32_t>> queue;
  for (const uint32_t seed : StationNodes(model)) {
    ways[seed] = {width_, seed};
    queue.emplace(width_, seed);
  }
  while (!queue.empty()) {
    const auto [width, at] = queue.top();
    queue.pop();
    if (width < ways[at].width) continue;
    nodes_.ForEachStep(at, [&, so_far = width, from = at](uint32_t to) {
      const float least = std::min(so_far, clear_width_[to]);
      if (least <= ways[to].width) return;
      ways[to] = {least, clear_width_[to] < so_far ? to : ways[from].narrowest};
      queue.emplace(least, to);
    });
  }
  return ways;
}

bool ReachMap::Fits(const Eigen::Vector3d& place) const {
  const std::optional<uint32_t> node = nodes_.Under(place);
  return node.has_value() && Passable(*node);
}

bool ReachMap::Reached(const Eigen::Vector3d& place) const {
  const std::optional<uint32_t> node = nodes_.Under(place);
  return node.has_value() && reached_[*node] != 0;
}

std::optional<double> ReachMap::Travel(const Eigen::Vector3d& place) const {
  const std::optional<uint32_t> node = nodes_.Under(place);
  if (!node.has_value() || travel_[*node] == kFar) return std::nullopt;
  return travel_[*node];
}

}  // namespace vantage::planning
