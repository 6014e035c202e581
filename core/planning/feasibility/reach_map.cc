#include "core/planning/feasibility/reach_map.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

#include "absl/status/status.h"

namespace vantage::planning {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

constexpr double kNeedles = 1.0;  // m, around a station

constexpr double kTripod = 0.75;  // m, around a station

constexpr double kHanging = 0.5;  // m, over known-empty space

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
                                        const visibility::OpaqueGrid& grid,
                                        const FloorHeights& floor, const PlanningConfig& config,
                                        const Eigen::Vector2i& first, const Eigen::Vector2i& size,
                                        int voxels_per_cell,
                                        const parallel::Cancellation& cancelled) {
  ReachMap map;
  map.first_ = first;
  map.size_ = size;
  map.per_cell_ = voxels_per_cell;
  map.cell_size_ = voxels_per_cell * model.voxel_size();
  const size_t columns = static_cast<size_t>(size.x()) * static_cast<size_t>(size.y());
  map.passable_.assign(columns, 0);
  map.reached_.assign(columns, 0);
  map.travel_.assign(columns, kFar);
  map.floor_.assign(columns, std::numeric_limits<float>::quiet_NaN());
  map.FindPassable(model, grid, floor, config, cancelled);
  if (!cancelled.Requested()) map.Flood(model, cancelled);
  if (cancelled.Requested()) return absl::CancelledError("reachability");
  return map;
}

void ReachMap::FindPassable(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                            const FloorHeights& floor, const PlanningConfig& config,
                            const parallel::Cancellation& cancelled) {
  const double voxel = model.voxel_size();
  const double radius = config.scanner_width / 2 / voxel;  // in voxels
  const int margin = static_cast<int>(std::ceil(radius)) + 1;
  const int x0 = first_.x() * per_cell_ - margin;
  const int y0 = first_.y() * per_cell_ - margin;
  const int nx = size_.x() * per_cell_ + 2 * margin;
  const int ny = size_.y() * per_cell_ + 2 * margin;
  std::vector<uint8_t> blocked(static_cast<size_t>(nx) * static_cast<size_t>(ny), 1);
  for (int j = 0; j < ny; ++j) {
    if (cancelled.Requested()) return;
    for (int i = 0; i < nx; ++i) {
      const int x = x0 + i;
      const int y = y0 + j;
      const float height = floor.Height(x, y);
      if (std::isnan(height)) continue;
      const int low = FirstLayerOverFloor(height, voxel);
      const int high = static_cast<int>(
          std::ceil((static_cast<double>(height) + config.scanner_height) / voxel - 1e-6));
      bool free = FreeToPass(model, grid, x, y, low, high);
      for (const model::Station& station : model.stations()) {
        if (free) break;
        const double away = std::hypot((x + 0.5) * voxel - station.position.x(),
                                       (y + 0.5) * voxel - station.position.y());
        free = away <= 2 * (station.position.z() - static_cast<double>(height)) &&
               OnTheWayIn(model, x, y, low, high, away);
      }
      blocked[static_cast<size_t>(i) + static_cast<size_t>(nx) * static_cast<size_t>(j)] = !free;
    }
  }
  for (int cy = first_.y(); cy < first_.y() + size_.y(); ++cy) {
    if (cancelled.Requested()) return;
    for (int cx = first_.x(); cx < first_.x() + size_.x(); ++cx) {
      const double mx = (cx + 0.5) * per_cell_;  // the column's centre, in voxels
      const double my = (cy + 0.5) * per_cell_;
      floor_[Index(cx, cy)] =
          floor.Height(static_cast<int>(std::floor(mx)), static_cast<int>(std::floor(my)));
      bool fits = !std::isnan(floor_[Index(cx, cy)]);
      for (int y = static_cast<int>(std::floor(my - radius)); fits && y < my + radius; ++y) {
        const double dy = std::max({0.0, y - my, my - (y + 1)});
        for (int x = static_cast<int>(std::floor(mx - radius)); fits && x < mx + radius; ++x) {
          const double dx = std::max({0.0, x - mx, mx - (x + 1)});
          if (dx * dx + dy * dy >= radius * radius - 1e-9) continue;
          fits = blocked[static_cast<size_t>(x - x0) +
                         static_cast<size_t>(nx) * static_cast<size_t>(y - y0)] == 0;
        }
      }
      passable_[Index(cx, cy)] = fits;
    }
  }
}

void ReachMap::Flood(const model::PlanningView& model, const parallel::Cancellation& cancelled) {
  using Entry = std::pair<float, uint32_t>;  // length so far (m), column
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
      const int x = static_cast<int>(at) % size_.x();
      const int y = static_cast<int>(at) / size_.x();
      for (int j = std::max(0, y - 1); j <= std::min(size_.y() - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(size_.x() - 1, x + 1); ++i) {
          const uint32_t to = static_cast<uint32_t>(i + size_.x() * j);
          if (!passable_[to] || !(std::abs(floor_[to] - floor_[at]) <= FloorHeights::kMaxStep)) {
            continue;
          }
          const float length = static_cast<float>(cell_size_) *
                               (i != x && j != y ? std::numbers::sqrt2_v<float> : 1.0f);
          if (so_far + length >= distance[to]) continue;
          distance[to] = so_far + length;
          queue.emplace(distance[to], to);
        }
      }
    }
  };
  // A station counts as reached even where the scanner does not seem to fit, since it stood there.
  const auto column_of = [&](const model::Station& station) -> std::optional<uint32_t> {
    const int cx = static_cast<int>(std::floor(station.position.x() / cell_size_));
    const int cy = static_cast<int>(std::floor(station.position.y() / cell_size_));
    if (!Inside(cx, cy)) return std::nullopt;
    uint32_t at = static_cast<uint32_t>(Index(cx, cy));
    if (std::isnan(floor_[at])) floor_[at] = static_cast<float>(station.floor_height);
    return at;
  };
  std::vector<uint32_t> seeds;
  for (const model::Station& station : model.stations()) {
    if (const auto at = column_of(station); at.has_value()) seeds.push_back(*at);
  }
  std::vector<float> distance(passable_.size(), kFar);
  spread(seeds, distance);
  for (size_t at = 0; at < distance.size(); ++at) reached_[at] = distance[at] < kFar;
  if (model.stations().empty()) return;
  if (const auto at = column_of(model.stations().back()); at.has_value()) spread({*at}, travel_);
}

std::optional<double> ReachMap::Travel(int cx, int cy) const {
  if (!Inside(cx, cy) || travel_[Index(cx, cy)] == kFar) return std::nullopt;
  return travel_[Index(cx, cy)];
}

}  // namespace vantage::planning
