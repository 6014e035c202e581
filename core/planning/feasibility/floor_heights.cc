#include "core/planning/feasibility/floor_heights.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr size_t kColumnsBetweenPolls = 8192;
constexpr float kUpward = 0.87f;        // cosine of 30 degrees: normals of a rough floor scatter
constexpr double kNeighbourhood = 1.0;  // m; a lower floor this near shows that a piece is no floor
constexpr double kStepArea = 0.2;       // m^2 that a step has at least
constexpr double kIsolatedArea = 1.0;   // m^2 that a floor of its own has at least
constexpr double kFillReach = 3.0;      // m, over which heights are interpolated

// The lowest and highest kept floor in tiles of half the neighbourhood.
class Tiles {
 public:
  Tiles(int size_x, int size_y, int columns_per_tile)
      : per_tile_(columns_per_tile),
        nx_(size_x / columns_per_tile + 1),
        ny_(size_y / columns_per_tile + 1),
        kept_(static_cast<size_t>(nx_) * static_cast<size_t>(ny_)) {}

  void Add(int x, int y, float height) {
    std::vector<float>& heights = kept_[At(x / per_tile_, y / per_tile_)];
    for (const float h : heights) {
      if (std::abs(h - height) < 0.02f) return;
    }
    heights.push_back(height);
  }
  template <typename Fn>
  void ForEachAround(int x, int y, Fn&& fn) const {
    const int tx = x / per_tile_;
    const int ty = y / per_tile_;
    for (int j = std::max(0, ty - 2); j <= std::min(ny_ - 1, ty + 2); ++j) {
      for (int i = std::max(0, tx - 2); i <= std::min(nx_ - 1, tx + 2); ++i) {
        for (const float h : kept_[At(i, j)]) fn(h);
      }
    }
  }

 private:
  size_t At(int i, int j) const {
    return static_cast<size_t>(i) + static_cast<size_t>(nx_) * static_cast<size_t>(j);
  }
  int per_tile_, nx_, ny_;
  std::vector<std::vector<float>> kept_;
};

}  // namespace

// Connected columns whose candidate heights continue without a step.
struct FloorHeights::Piece {
  std::vector<uint32_t> columns;  // indices into height_
  double mean_height = 0;         // m
};

absl::StatusOr<FloorHeights> FloorHeights::Find(const model::PlanningView& model,
                                                std::optional<double> given,
                                                const parallel::Cancellation& cancelled) {
  FloorHeights field;
  const model::VoxelBox& box = model.bounds();
  if (box.empty()) return field;
  field.min_x_ = box.min.x();
  field.min_y_ = box.min.y();
  field.size_x_ = box.max.x() - box.min.x();
  field.size_y_ = box.max.y() - box.min.y();
  const size_t columns = static_cast<size_t>(field.size_x_) * static_cast<size_t>(field.size_y_);
  if (given.has_value()) {
    field.height_.assign(columns, static_cast<float>(*given));
    field.found_ = true;
    field.lowest_ = field.highest_ = static_cast<float>(*given);
    return field;
  }
  field.height_.assign(columns, kNone);
  if (!field.Measure(model, cancelled)) return absl::CancelledError("floor heights");
  return field;
}

// False when cancelled on the way.
bool FloorHeights::Measure(const model::PlanningView& model,
                           const parallel::Cancellation& cancelled) {
  const double voxel = model.voxel_size();
  std::vector<float> candidate(height_.size(), kNone);
  // Voxels come in ascending z, so the first of a column is its lowest.
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || surface.normal.z() < kUpward) return;
        float& height = candidate[Index(v.x(), v.y())];
        if (!std::isnan(height)) return;
        if (!model.Empty(v + model::VoxelIndex(0, 0, 1)) &&
            !model.Empty(v + model::VoxelIndex(0, 0, 2)))
          return;
        height = surface.centroid.z();
      });
  if (!whole) return false;
  std::vector<Piece> pieces = FindPieces(candidate, voxel, cancelled);
  if (cancelled.Requested()) return false;
  KeepFloors(model, candidate, std::move(pieces), cancelled);
  SeedStations(model);
  if (cancelled.Requested()) return false;
  for (const float height : height_) {
    if (std::isnan(height)) continue;
    lowest_ = found_ ? std::min(lowest_, height) : height;
    highest_ = found_ ? std::max(highest_, height) : height;
    found_ = true;
  }
  Interpolate(kFillReach, voxel, cancelled);
  return !cancelled.Requested();
}

std::vector<FloorHeights::Piece> FloorHeights::FindPieces(
    const std::vector<float>& candidate, double voxel,
    const parallel::Cancellation& cancelled) const {
  std::vector<Piece> pieces;
  std::vector<uint8_t> taken(candidate.size(), 0);
  const float step = static_cast<float>(1.5 * voxel);
  for (uint32_t seed = 0; seed < candidate.size(); ++seed) {
    if (seed % kColumnsBetweenPolls == 0 && cancelled.Requested()) return pieces;
    if (taken[seed] || std::isnan(candidate[seed])) continue;
    Piece piece;
    piece.columns.push_back(seed);
    taken[seed] = 1;
    for (size_t head = 0; head < piece.columns.size(); ++head) {
      if ((head + 1) % kColumnsBetweenPolls == 0 && cancelled.Requested()) return pieces;
      const uint32_t at = piece.columns[head];
      piece.mean_height += candidate[at];
      const int x = static_cast<int>(at) % size_x_;
      const int y = static_cast<int>(at) / size_x_;
      for (int j = std::max(0, y - 1); j <= std::min(size_y_ - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(size_x_ - 1, x + 1); ++i) {
          const uint32_t to = static_cast<uint32_t>(i + size_x_ * j);
          if (taken[to] || !(std::abs(candidate[to] - candidate[at]) <= step)) continue;
          taken[to] = 1;
          piece.columns.push_back(to);
        }
      }
    }
    piece.mean_height /= static_cast<double>(piece.columns.size());
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

void FloorHeights::KeepFloors(const model::PlanningView& model, const std::vector<float>& candidate,
                              std::vector<Piece> pieces, const parallel::Cancellation& cancelled) {
  const double voxel = model.voxel_size();
  Tiles tiles(size_x_, size_y_, std::max(1, static_cast<int>(kNeighbourhood / 2 / voxel)));
  const auto keep = [&](const Piece& piece) {
    for (const uint32_t at : piece.columns) {
      height_[at] = candidate[at];
      tiles.Add(static_cast<int>(at) % size_x_, static_cast<int>(at) / size_x_, candidate[at]);
    }
  };
  // A piece that carries a station is a floor in any case.
  const auto carries_station = [&](const Piece& piece) {
    size_t until_poll = 0;
    for (const uint32_t at : piece.columns) {
      if (until_poll-- == 0) {
        if (cancelled.Requested()) return false;
        until_poll = kColumnsBetweenPolls / std::max<size_t>(1, model.stations().size());
      }
      const int column = static_cast<int>(at) % size_x_, row = static_cast<int>(at) / size_x_;
      const double x = (min_x_ + column + 0.5) * voxel, y = (min_y_ + row + 0.5) * voxel;
      for (const model::Station& station : model.stations()) {
        if (!station.floor_found) continue;
        const double reach = 1.5 * std::max(1.0, station.position.z() - station.floor_height);
        if (std::hypot(x - station.position.x(), y - station.position.y()) < reach &&
            std::abs(candidate[at] - station.floor_height) < 2 * voxel) {
          return true;
        }
      }
    }
    return false;
  };
  std::vector<Piece> others;
  bool any = false;
  for (Piece& piece : pieces) {
    if (cancelled.Requested()) return;
    if (carries_station(piece)) {
      keep(piece);
      any = true;
    } else {
      others.push_back(std::move(piece));
    }
  }
  // The others are looked at from the lowest up, so that a stair continues step by step.
  std::stable_sort(others.begin(), others.end(),
                   [](const Piece& a, const Piece& b) { return a.mean_height < b.mean_height; });
  for (const Piece& piece : others) {
    if (cancelled.Requested()) return;
    const double area = static_cast<double>(piece.columns.size()) * voxel * voxel;
    bool level = false;
    bool stepped = false;
    bool raised = false;
    for (const uint32_t at : piece.columns) {
      const float z = candidate[at];
      tiles.ForEachAround(static_cast<int>(at) % size_x_, static_cast<int>(at) / size_x_,
                          [&](float kept) {
                            level |= std::abs(z - kept) <= 2 * voxel;
                            stepped |= std::abs(z - kept) <= kMaxStep;
                            raised |= z - kept > kMaxStep;
                          });
      if (level) break;
    }
    const bool isolated = area >= (any ? kIsolatedArea : kStepArea) && !raised;
    if (level || (stepped && area >= kStepArea) || isolated) {
      keep(piece);
      any = true;
    }
  }
}

void FloorHeights::SeedStations(const model::PlanningView& model) {
  const double voxel = model.voxel_size();
  for (const model::Station& station : model.stations()) {
    if (!station.floor_found) continue;
    const int reach = static_cast<int>(std::ceil(station.clearance / voxel));
    const model::VoxelIndex at = model.At(station.position);
    for (int y = at.y() - reach; y <= at.y() + reach; ++y) {
      for (int x = at.x() - reach; x <= at.x() + reach; ++x) {
        if (x < min_x_ || y < min_y_ || x >= min_x_ + size_x_ || y >= min_y_ + size_y_) continue;
        if (std::hypot((x + 0.5) * voxel - station.position.x(),
                       (y + 0.5) * voxel - station.position.y()) > station.clearance) {
          continue;
        }
        float& height = height_[Index(x, y)];
        if (std::isnan(height)) height = static_cast<float>(station.floor_height);
      }
    }
  }
}

void FloorHeights::Interpolate(double reach, double voxel,
                               const parallel::Cancellation& cancelled) {
  std::vector<uint32_t> front;
  for (uint32_t at = 0; at < height_.size(); ++at) {
    if (!std::isnan(height_[at])) front.push_back(at);
  }
  const int layers = static_cast<int>(reach / voxel);
  std::vector<uint8_t> queued(height_.size(), 0);
  std::vector<uint32_t> next;
  std::vector<float> filled;
  for (int layer = 0; layer < layers && !front.empty() && !cancelled.Requested(); ++layer) {
    next.clear();
    for (const uint32_t at : front) {
      const int x = static_cast<int>(at) % size_x_;
      const int y = static_cast<int>(at) / size_x_;
      for (int j = std::max(0, y - 1); j <= std::min(size_y_ - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(size_x_ - 1, x + 1); ++i) {
          const uint32_t to = static_cast<uint32_t>(i + size_x_ * j);
          if (queued[to] || !std::isnan(height_[to])) continue;
          queued[to] = 1;
          next.push_back(to);
        }
      }
    }
    // A layer is filled from the layers before it only, so that the order within it does not
    // matter.
    filled.assign(next.size(), 0);
    for (size_t k = 0; k < next.size(); ++k) {
      const int x = static_cast<int>(next[k]) % size_x_;
      const int y = static_cast<int>(next[k]) / size_x_;
      float sum = 0;
      int count = 0;
      for (int j = std::max(0, y - 1); j <= std::min(size_y_ - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(size_x_ - 1, x + 1); ++i) {
          const float height = height_[static_cast<size_t>(i + size_x_ * j)];
          if (std::isnan(height)) continue;
          sum += height;
          ++count;
        }
      }
      filled[k] = sum / static_cast<float>(count);
    }
    for (size_t k = 0; k < next.size(); ++k) height_[next[k]] = filled[k];
    front.swap(next);
  }
}

}  // namespace vantage::planning
