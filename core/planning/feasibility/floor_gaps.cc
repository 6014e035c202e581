#include "core/planning/feasibility/floor_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "core/planning/feasibility/floor_pieces.h"
#include "core/planning/feasibility/raised_stations.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kColumnsBetweenLooks = 8192;
constexpr double kGap = 2.5;         // m across: the blind cone under a high tripod
constexpr double kWidestCone = 1.2;  // radius in heights: of those that see down to 40 degrees
constexpr double kNoRoom = 1.0;      // m, between floors over one another: nobody stands there
constexpr double kNarrow = 0.3;  // m across: what the shadow of a cable hides, or a few lost rays

// True around a station on this floor, where its scanner looks down past the floor or nearly: that
// there was none, somebody who stood there would have known. Within the blind cone of most scanners
// nothing else has to be known; of those that see less, what is empty has to end where the field of
// view does, and not at a shadow or where rays did not come back: a drop behind glass, or seen flat
// over its edge, looks like that.
bool InBlindCone(const model::PlanningView& model, const Eigen::Vector2i& at, float height) {
  const Eigen::Vector2d centre = (at.cast<double>().array() + 0.5) * model.voxel_size();
  double nearest = kWidestCone;  // in heights over the floor
  for (const model::Station& station : model.stations()) {
    if (std::abs(station.floor_height - static_cast<double>(height)) > kMaxStep) continue;
    const double over = station.position.z() - static_cast<double>(height);
    nearest = std::min(nearest, (station.position.head<2>() - centre).norm() / over);
  }
  if (nearest <= kBlindCone || nearest >= kWidestCone) return nearest <= kBlindCone;
  const int layer = LayerOf(height, model.voxel_size());
  for (int z = layer + 2; z >= layer - 1; --z) {
    const model::VoxelState state = model.State({at.x(), at.y(), z});
    if (state == model::VoxelState::kEmpty) continue;
    return state == model::VoxelState::kFalseImage || state == model::VoxelState::kAbsorbed ||
           state == model::VoxelState::kUnknown;
  }
  return false;
}

// What was measured in a column of voxels. Neighbours of a column mostly ask for the same layers,
// so the last answers are kept.
class MeasuredColumn {
 public:
  MeasuredColumn(const model::PlanningView& model, const Eigen::Vector2i& at)
      : model_(model), at_(at) {}

  // z within a step of this height, m, with empty space on top.
  std::optional<float> SurfaceNear(float height) {
    const auto step = static_cast<float>(kMaxStep);
    const int low = LayerOf(height - step, model_.voxel_size());
    const int high = LayerOf(height + step, model_.voxel_size());
    if (low != low_ || high != high_) {
      low_ = low;
      high_ = high;
      top_ = Top();
    }
    return top_.has_value() && std::abs(*top_ - height) <= step ? top_ : std::nullopt;
  }

  // True when surface was measured at this height.
  bool MeasuredAt(float height) {
    const int layer = LayerOf(height, model_.voxel_size());
    if (!asked_ || layer != layer_) {
      asked_ = true;
      layer_ = layer;
      measured_ = false;
      for (int z = layer - 1; z <= layer + 1; ++z) {
        measured_ |= model_.State({at_.x(), at_.y(), z}) == model::VoxelState::kTrueSurface;
      }
    }
    return measured_;
  }

 private:
  // z of the highest of the layers that is not empty, if it was measured and what is above is
  // empty.
  std::optional<float> Top() const {
    for (int z = high_; z >= low_; --z) {
      const model::VoxelIndex v(at_.x(), at_.y(), z);
      const model::VoxelState state = model_.State(v);
      if (state == model::VoxelState::kEmpty) continue;
      if (state != model::VoxelState::kTrueSurface ||
          !model_.Empty(v + model::VoxelIndex(0, 0, 1))) {
        return std::nullopt;
      }
      return model_.Surface(v)->centroid.z();
    }
    return std::nullopt;
  }

  const model::PlanningView& model_;
  const Eigen::Vector2i at_;
  int low_ = 0;
  int high_ = -1;  // below low_: nothing was asked
  std::optional<float> top_;
  bool asked_ = false;
  int layer_ = 0;
  bool measured_ = false;
};

// A floor cannot be more than a voxel higher than the middle of where the empty space over it ends:
// `height`, m, or that.
float NotInTheAir(const model::PlanningView& model, const Eigen::Vector2i& at, float height) {
  const double voxel = model.voxel_size();
  const int lowest = LayerOf(height - static_cast<float>(kMaxStep), voxel);
  int z = LayerOf(height, voxel);
  while (z >= lowest && model.Empty({at.x(), at.y(), z})) --z;
  const auto end = static_cast<float>((z + 0.5) * voxel);
  return end < height - static_cast<float>(voxel) ? end : height;
}

// Whether floor may be assumed in the `count` columns between two floors.
bool MayBeFloor(const model::PlanningView& model, const RaisedStations& raised,
                const Eigen::Vector2i& from, const Eigen::Vector2i& step, int count, float lower) {
  const double width = count * step.cast<double>().norm() * model.voxel_size();
  for (int k = 1; k <= count; ++k) {
    const Eigen::Vector2i at = from + k * step;
    // On stairs a line across more than one step's shadow says nothing of the steps between.
    const bool assumed = width <= kNarrow && raised.Assumed(at, lower);
    if (OpenBelow(model, at, lower) && !assumed) return false;
    if (width > kNarrow && !InBlindCone(model, at, lower)) return false;
  }
  return true;
}

// A straight line over columns without floor at the height of those at its ends.
struct Gap {
  Eigen::Vector2i from;  // the column at its near end
  Eigen::Vector2i step;  // to the next column
  int count = 0;         // columns between the ends
  float near = 0;        // m, z, of the floors at its ends
  float far = 0;

  float lower() const { return std::min(near, far); }
  double width(double voxel) const { return count * step.cast<double>().norm() * voxel; }
  float HeightAt(int k) const {
    return near + static_cast<float>(k) / static_cast<float>(count + 1) * (far - near);
  }
  uint32_t ColumnAt(int k, const FloorColumns& floor) const {
    const Eigen::Vector2i at = from + k * step;
    return floor.ColumnOf(at.x(), at.y());
  }
};

// Calls fn(gap) for all of at most kGap along the grid's eight directions. False when cancelled on
// the way.
template <typename Fn>
bool ForEachGap(const model::PlanningView& model, const FloorColumns& floor,
                const parallel::Cancellation& cancelled, Fn fn) {
  // Each line is walked from one of its ends only.
  static const std::array<Eigen::Vector2i, 4> kLines = {
      Eigen::Vector2i(1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(1, 1), Eigen::Vector2i(1, -1)};
  for (uint32_t column = 0; column < floor.columns(); ++column) {
    if (column % kColumnsBetweenLooks == 0 && cancelled.Requested()) return false;
    const Eigen::Vector2i from = floor.Voxel(column);
    for (const Floor& near : floor.In(column)) {
      for (const Eigen::Vector2i& step : kLines) {
        const int most = static_cast<int>(kGap / (step.cast<double>().norm() * model.voxel_size()));
        const Floor* far = nullptr;
        int count = 0;
        for (; count <= most; ++count) {
          const Eigen::Vector2i at = from + (count + 1) * step;
          if (!floor.Inside(at.x(), at.y())) break;
          far = floor.Near(at.x(), at.y(), near.height, kMaxStep);
          if (far != nullptr) break;
        }
        if (far != nullptr && count > 0) fn(Gap{from, step, count, near.height, far->height});
      }
    }
  }
  return true;
}

// Lines across a blind cone that cross at two heights, with no room between them, were laid over an
// edge that hides what lies behind it: that is lower than the edge.
void DropUpper(std::vector<PlacedFloor>& cones) {
  std::sort(cones.begin(), cones.end(), [](const PlacedFloor& a, const PlacedFloor& b) {
    return std::tie(a.column, a.floor.height) < std::tie(b.column, b.floor.height);
  });
  PlacedFloor lowest;
  bool any = false;
  std::erase_if(cones, [&](const PlacedFloor& here) {
    const double over = any && here.column == lowest.column
                            ? static_cast<double>(here.floor.height - lowest.floor.height)
                            : kNoRoom;
    if (over >= kNoRoom) lowest = here;
    any = true;
    return over > kMaxStep && over < kNoRoom;
  });
}

}  // namespace

std::vector<PlacedFloor> FloorUnderStations(const model::PlanningView& model,
                                            const FloorColumns& floor) {
  std::vector<PlacedFloor> found;
  const double voxel = model.voxel_size();
  const RaisedStations raised(model, floor);
  for (const model::Station& station : model.stations()) {
    if (!station.floor_found || raised.Has(station)) continue;
    const int reach = static_cast<int>(std::ceil(station.clearance / voxel));
    const auto height = static_cast<float>(station.floor_height);
    const model::VoxelIndex at = model.At(station.position);
    for (int y = at.y() - reach; y <= at.y() + reach; ++y) {
      for (int x = at.x() - reach; x <= at.x() + reach; ++x) {
        if (!floor.Inside(x, y) || floor.Near(x, y, height, kMaxStep) != nullptr) continue;
        const Eigen::Vector2d centre(Eigen::Vector2d(x + 0.5, y + 0.5) * voxel);
        if ((centre - station.position.head<2>()).norm() > station.clearance) continue;
        if (OpenBelow(model, {x, y}, height)) continue;  // it stood beside an edge
        found.push_back({floor.ColumnOf(x, y), {height, FloorSource::kStation}});
      }
    }
  }
  // Where several stood, the first says how high.
  std::stable_sort(found.begin(), found.end(),
                   [](const PlacedFloor& a, const PlacedFloor& b) { return a.column < b.column; });
  std::vector<PlacedFloor> once;
  for (const PlacedFloor& p : found) {
    const auto same = [&](const PlacedFloor& o) {
      return static_cast<double>(std::abs(o.floor.height - p.floor.height)) <= kMaxStep;
    };
    auto own = once.rbegin();
    while (own != once.rend() && own->column == p.column && !same(*own)) ++own;
    if (own == once.rend() || own->column != p.column) once.push_back(p);
  }
  return once;
}

std::optional<std::vector<PlacedFloor>> FloorAtWalls(const model::PlanningView& model,
                                                     const FloorColumns& floor,
                                                     const parallel::Cancellation& cancelled) {
  std::vector<PlacedFloor> found;
  std::vector<float> heights;  // of one column
  for (uint32_t column = 0; column < floor.columns(); ++column) {
    if (column % kColumnsBetweenLooks == 0 && cancelled.Requested()) return std::nullopt;
    const Eigen::Vector2i at = floor.Voxel(column);
    heights.clear();
    MeasuredColumn measured(model, at);
    const auto add = [&](float height, double apart) {
      const auto same = [&](float other) {
        return static_cast<double>(std::abs(other - height)) <= apart;
      };
      if (floor.Near(at.x(), at.y(), height, apart) != nullptr) return;
      if (std::none_of(heights.begin(), heights.end(), same)) heights.push_back(height);
    };
    const auto for_each_beside = [&](const auto& fn) {
      for (int y = at.y() - 1; y <= at.y() + 1; ++y) {
        for (int x = at.x() - 1; x <= at.x() + 1; ++x) {
          for (const Floor& beside : floor.At(x, y)) fn(beside.height);
        }
      }
    };
    // What was measured itself comes first, so that the edge of a step is at its own height; it may
    // lie over the floor at the foot of the riser, in the same column.
    for_each_beside([&](float beside) {
      if (const auto height = measured.SurfaceNear(beside)) add(*height, kRoughness);
    });
    for_each_beside([&](float beside) {
      if (measured.MeasuredAt(beside)) add(beside, kMaxStep);
    });
    for (const float height : heights) found.push_back({column, {height, FloorSource::kMeasured}});
  }
  return found;
}

std::optional<std::vector<PlacedFloor>> FloorBetween(const model::PlanningView& model,
                                                     const FloorColumns& floor,
                                                     const parallel::Cancellation& cancelled) {
  const RaisedStations raised(model, floor);
  std::vector<PlacedFloor> crossings;  // of shadows and lost rays
  std::vector<PlacedFloor> cones;      // of blind cones
  const bool all = ForEachGap(model, floor, cancelled, [&](const Gap& gap) {
    if (!MayBeFloor(model, raised, gap.from, gap.step, gap.count, gap.lower())) return;
    const bool narrow = gap.width(model.voxel_size()) <= kNarrow;
    for (int k = 1; k <= gap.count; ++k) {
      // Where there is a step in a narrow gap, it is nowhere higher than its upper side.
      const float height = narrow ? std::max(gap.near, gap.far) : gap.HeightAt(k);
      (narrow ? crossings : cones)
          .push_back({gap.ColumnAt(k, floor), {height, FloorSource::kBetween}});
    }
  });
  if (!all) return std::nullopt;
  DropUpper(cones);
  crossings.insert(crossings.end(), cones.begin(), cones.end());
  std::vector<PlacedFloor> found;
  for (const auto& [column, between] : MeanOfLines(std::move(crossings), kMaxStep)) {
    const Eigen::Vector2i at = floor.Voxel(column);
    const float mean = between.height;
    const float height = raised.Assumed(at, mean) ? mean : NotInTheAir(model, at, mean);
    if (floor.Near(at.x(), at.y(), height, kMaxStep) != nullptr) continue;
    found.push_back({column, {height, FloorSource::kBetween}});
  }
  return found;
}

std::optional<std::vector<PlacedFloor>> FloorInShadows(const model::PlanningView& model,
                                                       const FloorColumns& floor,
                                                       const parallel::Cancellation& cancelled) {
  std::vector<PlacedFloor> crossings;
  const bool all = ForEachGap(model, floor, cancelled, [&](const Gap& gap) {
    for (int k = 1; k <= gap.count; ++k) {
      if (OpenBelow(model, gap.from + k * gap.step, gap.lower())) return;
    }
    for (int k = 1; k <= gap.count; ++k) {
      crossings.push_back({gap.ColumnAt(k, floor), {gap.HeightAt(k), FloorSource::kExpected}});
    }
  });
  if (!all) return std::nullopt;
  return MeanOfLines(std::move(crossings), kMaxStep);
}

}  // namespace vantage::planning
