#include "core/planning/feasibility/floor_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>
#include <utility>

#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

constexpr size_t kColumnsBetweenPolls = 8192;
constexpr float kUpward = 0.87f;        // cosine of 30 degrees: normals of a rough floor scatter
constexpr double kNeighbourhood = 1.0;  // m; a lower floor this near shows that a piece is no floor
constexpr double kTable = 1.5;          // m; pieces up to this high over a floor are furniture
constexpr double kStepArea = 0.1;       // m^2 that a step has at least; its edges don't count
constexpr double kIsolatedArea = 1.0;   // m^2 that a floor of its own has at least
constexpr double kStoreyArea = 2.0;     // m^2 that a floor of its own high over another has
constexpr double kHeadroom = 1.5;       // m over such a floor; the top of a wardrobe has less
constexpr int kThickness = 2;           // voxels that one surface takes up at most

// The heights of kept floor in tiles of half the neighbourhood.
class Tiles {
 public:
  Tiles(const Eigen::Vector2i& size, int columns_per_tile)
      : per_tile_(columns_per_tile),
        nx_(size.x() / columns_per_tile + 1),
        ny_(size.y() / columns_per_tile + 1),
        kept_(static_cast<size_t>(nx_) * static_cast<size_t>(ny_)) {}

  void Add(const Eigen::Vector2i& at, float height) {
    std::vector<float>& heights = kept_[At(at.x() / per_tile_, at.y() / per_tile_)];
    for (const float h : heights) {
      if (std::abs(h - height) < 0.02f) return;
    }
    heights.push_back(height);
  }
  template <typename Fn>
  void ForEachAround(const Eigen::Vector2i& at, Fn&& fn) const {
    const int tx = at.x() / per_tile_;
    const int ty = at.y() / per_tile_;
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

// Measured surface that faces up, with empty space on top.
struct Candidate {
  uint32_t column = 0;
  int layer = 0;     // of voxels
  float height = 0;  // m
};

// Connected candidates whose heights continue without a step.
struct Piece {
  std::vector<uint32_t> candidates;
  double mean_height = 0;  // m
};

class Pieces {
 public:
  Pieces(const model::PlanningView& model, const FloorColumns& columns,
         const parallel::Cancellation& cancelled)
      : model_(model),
        columns_(columns),
        cancelled_(cancelled),
        tiles_(columns.size(),
               std::max(1, static_cast<int>(kNeighbourhood / 2 / model.voxel_size()))) {}

  bool Collect();
  void Connect();
  std::vector<PlacedFloor> Keep();

 private:
  Eigen::Vector2i Offset(const Candidate& candidate) const {
    return {static_cast<int>(candidate.column) % columns_.size().x(),
            static_cast<int>(candidate.column) / columns_.size().x()};
  }
  std::vector<Candidate> AbsorbedBetween(const std::vector<Candidate>& found) const;
  std::optional<int> AbsorbedLayer(uint32_t column, int layer) const;
  bool CarriesStation(const Piece& piece) const;
  bool HasHeadroom(const Piece& piece) const;
  bool IsFloor(const Piece& piece, bool any) const;

  const model::PlanningView& model_;
  const FloorColumns& columns_;
  const parallel::Cancellation& cancelled_;
  std::vector<Candidate> candidates_;  // by column, from the lowest up
  std::vector<uint32_t> begin_;        // of each column its first candidate; one more at the end
  std::vector<Piece> pieces_;
  Tiles tiles_;
};

// False when cancelled on the way.
bool Pieces::Collect() {
  std::vector<Candidate> found;
  const bool whole = visibility::WalkSurface(
      model_, cancelled_,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || surface.normal.z() < kUpward) return;
        if (!model_.Empty(v + model::VoxelIndex(0, 0, 1)) &&
            !model_.Empty(v + model::VoxelIndex(0, 0, 2)))
          return;
        // What was only interpolated, over space known to be empty, is not there.
        if (surface.samples == 0 && model_.Empty(v - model::VoxelIndex(0, 0, 1)) &&
            model_.Empty(v - model::VoxelIndex(0, 0, 2)))
          return;
        found.push_back({columns_.ColumnOf(v.x(), v.y()), v.z(), surface.centroid.z()});
      });
  if (!whole) return false;
  // Voxels come in ascending z, and keep that order within their column.
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.column < b.column; });
  std::vector<Candidate> absorbed = AbsorbedBetween(found);
  if (cancelled_.Requested()) return false;
  const auto upwards = [](const Candidate& a, const Candidate& b) {
    return std::tie(a.column, a.layer) < std::tie(b.column, b.layer);
  };
  std::stable_sort(absorbed.begin(), absorbed.end(), upwards);
  const auto measured = static_cast<std::ptrdiff_t>(found.size());
  found.insert(found.end(), absorbed.begin(), absorbed.end());
  std::inplace_merge(found.begin(), found.begin() + measured, found.end(), upwards);
  begin_.assign(columns_.columns() + 1, 0);
  for (const Candidate& candidate : found) {
    // Of a surface that is several voxels thick the lowest counts.
    if (!candidates_.empty() && candidates_.back().column == candidate.column &&
        candidate.layer - candidates_.back().layer <= kThickness) {
      continue;
    }
    candidates_.push_back(candidate);
    ++begin_[candidate.column + 1];
  }
  for (size_t column = 1; column < begin_.size(); ++column) begin_[column] += begin_[column - 1];
  return !cancelled_.Requested();
}

// Where few samples fell, as on a tread that was seen flat, every second row of voxels or so was
// fused into the next: between two candidates of one height the surface is measured there too.
// Beside one alone it may be what an edge's samples spread to. `found`: by column, from the lowest
// up.
std::vector<Candidate> Pieces::AbsorbedBetween(const std::vector<Candidate>& found) const {
  constexpr int kMostFused = 2;  // voxels in a row, since surface is fused across as many
  static const std::array<Eigen::Vector2i, 4> kLines = {
      Eigen::Vector2i(1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(1, 1), Eigen::Vector2i(1, -1)};
  const auto same = static_cast<float>(1.5 * model_.voxel_size());
  const Eigen::Vector2i& size = columns_.size();
  std::vector<uint32_t> begin(columns_.columns() + 1, 0);  // in `found`, of each column
  for (const Candidate& candidate : found) ++begin[candidate.column + 1];
  for (size_t column = 1; column < begin.size(); ++column) begin[column] += begin[column - 1];
  std::vector<Candidate> absorbed;
  for (size_t i = 0; i < found.size(); ++i) {
    if (i % kColumnsBetweenPolls == 0 && cancelled_.Requested()) return {};
    const Eigen::Vector2i from = Offset(found[i]);
    for (const Eigen::Vector2i& step : kLines) {
      std::array<Candidate, kMostFused> between;
      for (int count = 0; count <= kMostFused; ++count) {
        const Eigen::Vector2i at = from + (count + 1) * step;
        if ((at.array() < 0).any() || (at.array() >= size.array()).any()) break;
        const auto column = static_cast<uint32_t>(at.x() + size.x() * at.y());
        const auto other = std::find_if(
            found.begin() + begin[column], found.begin() + begin[column + 1],
            [&](const Candidate& o) { return std::abs(o.height - found[i].height) <= same; });
        if (other != found.begin() + begin[column + 1]) {
          absorbed.insert(absorbed.end(), between.begin(), between.begin() + count);
          break;
        }
        const std::optional<int> layer = AbsorbedLayer(column, found[i].layer);
        if (!layer.has_value() || count == kMostFused) break;
        between[static_cast<size_t>(count)] = {column, *layer, found[i].height};
      }
    }
  }
  return absorbed;
}

// The layer within one of `layer` in which a column has absorbed surface with empty space on top.
std::optional<int> Pieces::AbsorbedLayer(uint32_t column, int layer) const {
  const Eigen::Vector2i at = columns_.Voxel(column);
  for (int z = layer + 1; z >= layer - 1; --z) {
    const model::VoxelState state = model_.State({at.x(), at.y(), z});
    if (state == model::VoxelState::kEmpty) continue;
    if (state != model::VoxelState::kAbsorbed) return std::nullopt;
    return model_.Empty({at.x(), at.y(), z + 1}) ? std::optional<int>(z) : std::nullopt;
  }
  return std::nullopt;
}

void Pieces::Connect() {
  std::vector<uint8_t> taken(candidates_.size(), 0);
  const float step = static_cast<float>(1.5 * model_.voxel_size());
  const Eigen::Vector2i& size = columns_.size();
  for (uint32_t seed = 0; seed < candidates_.size(); ++seed) {
    if (seed % kColumnsBetweenPolls == 0 && cancelled_.Requested()) return;
    if (taken[seed]) continue;
    Piece piece;
    piece.candidates.push_back(seed);
    taken[seed] = 1;
    for (size_t head = 0; head < piece.candidates.size(); ++head) {
      if ((head + 1) % kColumnsBetweenPolls == 0 && cancelled_.Requested()) return;
      const Candidate& at = candidates_[piece.candidates[head]];
      piece.mean_height += static_cast<double>(at.height);
      const Eigen::Vector2i c = Offset(at);
      for (int j = std::max(0, c.y() - 1); j <= std::min(size.y() - 1, c.y() + 1); ++j) {
        for (int i = std::max(0, c.x() - 1); i <= std::min(size.x() - 1, c.x() + 1); ++i) {
          const size_t column =
              static_cast<size_t>(i) + static_cast<size_t>(size.x()) * static_cast<size_t>(j);
          for (uint32_t to = begin_[column]; to < begin_[column + 1]; ++to) {
            if (taken[to] || !(std::abs(candidates_[to].height - at.height) <= step)) continue;
            taken[to] = 1;
            piece.candidates.push_back(to);
          }
        }
      }
    }
    piece.mean_height /= static_cast<double>(piece.candidates.size());
    pieces_.push_back(std::move(piece));
  }
}

bool Pieces::CarriesStation(const Piece& piece) const {
  const double voxel = model_.voxel_size();
  size_t until_poll = 0;
  for (const uint32_t i : piece.candidates) {
    if (until_poll-- == 0) {
      if (cancelled_.Requested()) return false;
      until_poll = kColumnsBetweenPolls / std::max<size_t>(1, model_.stations().size());
    }
    const Candidate& candidate = candidates_[i];
    const Eigen::Vector2d centre =
        (columns_.Voxel(candidate.column).cast<double>().array() + 0.5) * voxel;
    for (const model::Station& station : model_.stations()) {
      if (!station.floor_found) continue;
      const double reach = 1.5 * std::max(1.0, station.position.z() - station.floor_height);
      if ((centre - station.position.head<2>()).norm() < reach &&
          std::abs(static_cast<double>(candidate.height) - station.floor_height) < 2 * voxel) {
        return true;
      }
    }
  }
  return false;
}

// True when nothing measured hangs over most of it.
bool Pieces::HasHeadroom(const Piece& piece) const {
  const int layers = static_cast<int>(std::lround(kHeadroom / model_.voxel_size()));
  size_t low = 0;
  for (const uint32_t i : piece.candidates) {
    const Candidate& candidate = candidates_[i];
    const Eigen::Vector2i at = columns_.Voxel(candidate.column);
    for (int z = candidate.layer + kThickness + 1; z <= candidate.layer + layers; ++z) {
      if (model_.State({at.x(), at.y(), z}) != model::VoxelState::kTrueSurface) continue;
      ++low;
      break;
    }
  }
  return 2 * low < piece.candidates.size();
}

// Whether a piece that carries no station is floor, given the floor that is lower. `any`: there is
// some.
bool Pieces::IsFloor(const Piece& piece, bool any) const {
  const double voxel = model_.voxel_size();
  const double area = static_cast<double>(piece.candidates.size()) * voxel * voxel;
  bool level = false;
  bool stepped = false;
  bool raised = false;  // as furniture is
  bool high = false;    // over a floor, higher than furniture
  for (const uint32_t i : piece.candidates) {
    const float z = candidates_[i].height;
    tiles_.ForEachAround(Offset(candidates_[i]), [&](float kept) {
      const double over = static_cast<double>(z - kept);
      level |= std::abs(over) <= 2 * voxel;
      stepped |= std::abs(over) <= kMaxStep;
      raised |= over > kMaxStep && over <= kTable;
      high |= over > kTable;
    });
    if (level) return true;
  }
  if (stepped && area >= kStepArea) return true;
  if (raised) return false;
  if (high) return area >= kStoreyArea && HasHeadroom(piece);
  return area >= (any ? kIsolatedArea : kStepArea);
}

// From the lowest piece up, so that a stair continues step by step.
std::vector<PlacedFloor> Pieces::Keep() {
  std::vector<PlacedFloor> kept;
  const auto keep = [&](const Piece& piece) {
    for (const uint32_t i : piece.candidates) {
      const Candidate& candidate = candidates_[i];
      kept.push_back({candidate.column, {candidate.height, FloorSource::kMeasured}});
      tiles_.Add(Offset(candidate), candidate.height);
    }
  };
  std::vector<const Piece*> others;
  for (const Piece& piece : pieces_) {
    if (cancelled_.Requested()) return kept;
    if (CarriesStation(piece)) {
      keep(piece);
    } else {
      others.push_back(&piece);
    }
  }
  std::stable_sort(others.begin(), others.end(),
                   [](const Piece* a, const Piece* b) { return a->mean_height < b->mean_height; });
  for (const Piece* piece : others) {
    if (cancelled_.Requested()) return kept;
    if (IsFloor(*piece, !kept.empty())) keep(*piece);
  }
  return kept;
}

}  // namespace

std::optional<std::vector<PlacedFloor>> MeasuredFloor(const model::PlanningView& model,
                                                      const FloorColumns& columns,
                                                      const parallel::Cancellation& cancelled) {
  Pieces pieces(model, columns, cancelled);
  if (!pieces.Collect()) return std::nullopt;
  pieces.Connect();
  if (cancelled.Requested()) return std::nullopt;
  std::vector<PlacedFloor> kept = pieces.Keep();
  if (cancelled.Requested()) return std::nullopt;
  return kept;
}

}  // namespace vantage::planning
