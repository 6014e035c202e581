#include "core/planning/expectation/expectation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/memory/memory.h"
#include "absl/status/status.h"
#include "core/model/view/brick_key.h"
#include "core/planning/expectation/brick_edit.h"
#include "core/planning/expectation/flights.h"
#include "core/planning/expectation/looked_in_vain.h"
#include "core/planning/expectation/room_limits.h"
#include "core/planning/expectation/storey_beyond.h"
#include "core/planning/openings/storey_section.h"

namespace vantage::planning {
namespace {

// A room is expected to go on so far from its doorway, straight in and to both sides, m, where no
// wall that was seen ends it before. As large as that, with bare walls, it brings as much as
// rooms that are smaller and furnished do: at places that are expected views were to gain 0.8 to
// 0.9 of what they gained, and 0.56 with 3.5 x 4 m counted at three quarters
// (client/study/experiments.md). Rooms of 6 to 30 m2.
constexpr RoomLimits kLargestRoom = {.depth = 4.5, .left = 2.5, .right = 2.5};
constexpr double kCeiling = 2.5;  // m over the floor, where the doorway is no higher
// A room in which so many places were rejected is not expected any more: nobody can enter it, since
// it is glass, a mirror's image or full of things.
constexpr int kMostRefusals = 2;
// m2 of a room's expected surface that stations looked at in vain, and more than was measured of
// the room: it is not expected. Of real rooms up to 4 m2 is, between rays and behind jambs, and at
// least two and a half times as much was measured; behind a glass door at once 7 m2, and a sixth of
// that was measured, its frame (core/planning/experiments.md). Shares of one room, so steps, range
// and voxels matter little.
constexpr double kLeastInVain = 2;
constexpr size_t kLookedAt = 4;  // one in so many of its voxels: 2 m2 are 200 of 5 cm
// Measured voxels with fewer others around them are returns from edges that met nothing (mixed
// pixels), or too small to be in anybody's way. Without this two of them under a lintel close a
// door of 0.95 m, in voxels of 5 cm, to a scanner of 0.6 m.
constexpr int kLeastAround = 2;
constexpr double kSameFloor = 0.5;   // m: floors of one room, also with a step or two
constexpr double kThreshold = 0.25;  // m before the middle of a doorway that belong to it

const std::array<Eigen::Vector2i, 4> kSides = {Eigen::Vector2i(-1, 0), Eigen::Vector2i(1, 0),
                                               Eigen::Vector2i(0, -1), Eigen::Vector2i(0, 1)};

using Column = std::pair<int, int>;  // x and y of voxels

bool WasMeasured(model::VoxelState state) {
  return state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
}

// The columns of a room, and those beside them, where its walls are.
template <typename Fn>
void ForEachColumnWithWalls(const std::vector<Eigen::Vector2i>& columns, Fn&& fn) {
  for (const Eigen::Vector2i& at : columns) {
    fn(Column(at.x(), at.y()));
    for (const Eigen::Vector2i& side : kSides) fn(Column(at.x() + side.x(), at.y() + side.y()));
  }
}

// What a room behind one doorway changes.
class RoomBehind {
 public:
  RoomBehind(const model::PlanningView& model, const Openings& openings, size_t opening)
      : model_(model),
        opening_(openings.openings[opening]),
        voxel_(model.voxel_size()),
        limits_(
            LimitsBehind(model, opening_, EndedBetweenDoorways(openings, opening, kLargestRoom))) {
    const double top = std::max(kCeiling, opening_.head);
    low_ = static_cast<int>(std::floor(opening_.centre.z() / voxel_));
    high_ = static_cast<int>(std::floor((opening_.centre.z() + top) / voxel_));
  }

  // The columns of the room, from its doorway in.
  std::vector<Eigen::Vector2i> Spread() const {
    std::vector<Eigen::Vector2i> columns;
    absl::flat_hash_set<Column> seen;
    const auto visit = [&](const Eigen::Vector2i& at) {
      if (!Within(at) || !seen.emplace(at.x(), at.y()).second || !GoesOn(at)) return;
      columns.push_back(at);
    };
    const Eigen::Vector2d along(-opening_.direction.y(), opening_.direction.x());
    const int half = static_cast<int>(std::floor(opening_.width / 2 / voxel_)) - 1;
    for (int i = -std::max(0, half); i <= std::max(0, half); ++i) {
      const Eigen::Vector2d p = opening_.centre.head<2>() + along * (i * voxel_);
      visit((p / voxel_).array().floor().cast<int>());
    }
    for (size_t head = 0; head < columns.size(); ++head) {
      for (const Eigen::Vector2i& side : kSides) visit(columns[head] + side);
    }
    return columns;
  }

  // Voxels of measured surface in these columns and beside them.
  size_t Measured(const std::vector<Eigen::Vector2i>& columns) const {
    absl::flat_hash_set<Column> all;
    ForEachColumnWithWalls(columns, [&](const Column& at) { all.insert(at); });
    size_t measured = 0;
    for (const auto& [x, y] : all) {
      for (int z = low_; z <= high_; ++z) measured += WasMeasured(model_.State({x, y, z})) ? 1 : 0;
    }
    return measured;
  }

  void Apply(const std::vector<Eigen::Vector2i>& columns, BrickEdit& edit,
             std::vector<ExpectedFloor>& floors) const {
    absl::flat_hash_set<Column> in_room;
    for (const Eigen::Vector2i& at : columns) in_room.emplace(at.x(), at.y());
    for (const Eigen::Vector2i& at : columns) {
      if (edit.CloseUnknown({at.x(), at.y(), low_}, {0, 0, 1}, opening_.centre.z())) {
        floors.push_back({at, static_cast<float>(opening_.centre.z())});
      }
      for (int z = low_ + 1; z < high_; ++z) {
        const model::VoxelIndex v(at.x(), at.y(), z);
        if (NothingKnown(model_.State(v))) edit.SetEmpty(v);
      }
      // Where the model knows of free space it says itself how that ends.
      if (NothingKnown(model_.State({at.x(), at.y(), high_ - 1}))) {
        edit.CloseUnknown({at.x(), at.y(), high_}, {0, 0, -1});
      }
      for (const Eigen::Vector2i& side : kSides) {
        const Eigen::Vector2i to = at + side;
        if (in_room.contains({to.x(), to.y()})) continue;
        for (int z = low_ + 1; z < high_; ++z) {
          if (!NothingKnown(model_.State({at.x(), at.y(), z}))) continue;
          edit.CloseUnknown({to.x(), to.y(), z}, {-side.x(), -side.y(), 0});
        }
      }
    }
  }

 private:
  // Within what a room behind the doorway is expected to take up.
  bool Within(const Eigen::Vector2i& at) const {
    const Eigen::Vector2d p = (at.cast<double>().array() + 0.5) * voxel_;
    const Eigen::Vector2d off = p - opening_.centre.head<2>();
    const Eigen::Vector2d direction = opening_.direction.head<2>();
    const double in = off.dot(direction);
    const double leftward = off.y() * direction.x() - off.x() * direction.y();
    if (in < -kThreshold || in > limits_.depth) return false;
    // In the doorway itself its jambs are the sides.
    if (in < kThreshold) return std::abs(leftward) <= opening_.width / 2;
    return leftward <= limits_.left && -leftward <= limits_.right;
  }
  // Nothing that was measured at the height of a head, and no drop where the floor would be.
  bool GoesOn(const Eigen::Vector2i& at) const {
    const int low = static_cast<int>(std::floor((opening_.centre.z() + kSectionLow) / voxel_));
    const int high = static_cast<int>(std::ceil((opening_.centre.z() + kSectionHigh) / voxel_));
    for (int z = low; z < high; ++z) {
      if (WasMeasured(model_.State({at.x(), at.y(), z}))) return false;
    }
    return !model_.Empty({at.x(), at.y(), low_ - 1}) && !model_.Empty({at.x(), at.y(), low_ - 2});
  }
  const model::PlanningView& model_;
  const Opening& opening_;
  const double voxel_;
  const RoomLimits limits_;
  int low_ = 0;   // the layer that the floor lies in
  int high_ = 0;  // the ceiling's
};

// Calls fn(v, its place in the brick's surface or nothing) for the voxels that a prior shows and of
// which nothing is known.
template <typename Fn>
void ForEachShown(const model::PlanningView& model, const ExpectedSite& site, Fn&& fn) {
  for (const model::BrickAt& at : site.view().bricks()) {
    size_t rank = 0;
    for (int local = 0; local < model::Brick::kVoxels; ++local) {
      const model::VoxelState state = at.contents->state[static_cast<size_t>(local)];
      const std::optional<size_t> own =
          model::HasArea(state) ? std::optional<size_t>(rank++) : std::nullopt;
      if (state == model::VoxelState::kUnknown) continue;
      const model::VoxelIndex v = model::PlanningView::Global(at.brick, local);
      if (NothingKnown(model.State(v))) fn(v, *at.contents, own);
    }
  }
}

// It goes before what else is expected.
void AddSite(const model::PlanningView& model, const ExpectedSite& site,
             const absl::flat_hash_set<Column>& by_prior, BrickEdit& edit,
             std::vector<ExpectedFloor>& floors) {
  ForEachShown(model, site,
               [&](const model::VoxelIndex& v, const model::Brick& brick,
                   const std::optional<size_t>& surface) {
                 if (surface.has_value()) {
                   edit.SetSurface(v, brick.surface[*surface]);
                 } else {
                   edit.SetEmpty(v);
                 }
               });
  // Floor that was measured a little higher or lower goes before (FloorMap::With()).
  for (const ExpectedFloor& floor : site.floors()) {
    if (by_prior.contains({floor.voxel.x(), floor.voxel.y()})) floors.push_back(floor);
  }
}

// Whether a prior shows what is behind a doorway: then nothing else is expected there, also where
// all that it shows is known by now.
bool Shown(const std::vector<Eigen::Vector2i>& room, double floor, const ExpectedSite& site) {
  const auto shown = std::count_if(room.begin(), room.end(), [&](const Eigen::Vector2i& at) {
    const auto floors = site.FloorsIn(at);
    return std::any_of(floors.begin(), floors.end(), [&](const ExpectedFloor& there) {
      return std::abs(static_cast<double>(there.height) - floor) <= kSameFloor;
    });
  });
  return 2 * static_cast<size_t>(shown) > room.size();
}

bool Refused(const model::PlanningView& model, const std::vector<Eigen::Vector2i>& columns,
             std::span<const RejectedPlace> rejected) {
  int refusals = 0;
  for (const RejectedPlace& place : rejected) {
    const Eigen::Vector2i at = model.At(place.position).head<2>();
    if (std::find(columns.begin(), columns.end(), at) != columns.end()) ++refusals;
  }
  return refusals >= kMostRefusals;
}

// A room that is expected behind a doorway.
struct BehindDoorway {
  size_t opening = 0;
  RoomBehind room;
  std::vector<Eigen::Vector2i> columns;
};

std::vector<BehindDoorway> RoomsBehindDoorways(const model::PlanningView& model,
                                               const Openings& openings,
                                               std::span<const RejectedPlace> rejected,
                                               const ExpectedSite* site,
                                               const parallel::Cancellation& cancelled) {
  std::vector<BehindDoorway> rooms;
  for (size_t i = 0; i < openings.openings.size() && !cancelled.Requested(); ++i) {
    const Opening& opening = openings.openings[i];
    if (!opening.doorway() || !openings.LeadsToUnknown(opening)) continue;
    const RoomBehind room(model, openings, i);
    std::vector<Eigen::Vector2i> columns = room.Spread();
    if (columns.empty() || Refused(model, columns, rejected)) continue;
    if (site != nullptr && Shown(columns, opening.centre.z(), *site)) continue;
    rooms.push_back({i, room, std::move(columns)});
  }
  return rooms;
}

// Whether stations looked at much of a room and saw nothing: who has scanned through a doorway and
// still knows nothing of what is behind it stands before glass or a mirror.
absl::StatusOr<bool> LookedIntoInVain(const model::PlanningView& model, const Opening& opening,
                                      const BehindDoorway& behind,
                                      const sensor::ScannerModel& scanner,
                                      const parallel::Cancellation& cancelled) {
  const std::vector<model::Station> stations = StationsBefore(model, opening);
  if (stations.empty()) return false;
  BrickEdit edit(model);
  std::vector<ExpectedFloor> floors;
  behind.room.Apply(behind.columns, edit, floors);
  const std::vector<model::BrickAt> changed = edit.Bricks();
  const model::PlanningView expected(model, model.version(), changed, model.stations());
  const auto looked_at =
      LookedAtInVain(model, expected, changed, stations, scanner, cancelled, kLookedAt);
  if (!looked_at.ok()) return looked_at.status();
  const size_t in_vain = kLookedAt * looked_at->size();  // voxels
  const double area = static_cast<double>(in_vain) * model.voxel_size() * model.voxel_size();
  return area >= kLeastInVain && in_vain > behind.room.Measured(behind.columns);
}

// Whether so few voxels around a measured one were measured that nobody heeds it.
bool Floats(const model::PlanningView& model, const model::VoxelIndex& v) {
  int around = 0;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        if (!WasMeasured(model.State(v + model::VoxelIndex(dx, dy, dz)))) continue;
        if (++around >= kLeastAround) return false;
      }
    }
  }
  return true;
}

// A brick of which all that was not measured is empty; null when nothing of it was measured.
std::shared_ptr<const model::Brick> MeasuredOf(const model::PlanningView& model,
                                               const model::BrickAt& at) {
  const model::Brick& brick = *at.contents;
  if (std::none_of(brick.state.begin(), brick.state.end(), WasMeasured)) return nullptr;
  auto measured = std::make_shared<model::Brick>();
  measured->state.fill(model::VoxelState::kEmpty);
  for (int local = 0; local < model::Brick::kVoxels; ++local) {
    const model::VoxelState state = brick.state[static_cast<size_t>(local)];
    if (!WasMeasured(state)) continue;
    if (Floats(model, model::PlanningView::Global(at.brick, local))) continue;
    measured->state[static_cast<size_t>(local)] = state;
    if (state != model::VoxelState::kTrueSurface) continue;
    measured->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
    measured->surface.push_back(brick.Surface(local).value());
  }
  return measured;
}

// The model with all that was not measured empty, within its bounds.
model::PlanningView MeasuredAlone(const model::PlanningView& model, parallel::Parallel& parallel) {
  constexpr size_t kBricksOfTask = 64;
  std::vector<model::BrickAt> changed(model.bricks().begin(), model.bricks().end());
  parallel.For((changed.size() + kBricksOfTask - 1) / kBricksOfTask, [&](size_t task) {
    const size_t end = std::min(changed.size(), (task + 1) * kBricksOfTask);
    for (size_t i = task * kBricksOfTask; i < end; ++i) {
      changed[i].contents = MeasuredOf(model, changed[i]);
    }
  });
  std::erase_if(changed, [](const model::BrickAt& at) { return at.contents == nullptr; });
  auto empty = std::make_shared<model::Brick>();
  empty->state.fill(model::VoxelState::kEmpty);
  model::EmptiedBricks emptied;
  emptied.contents = std::move(empty);
  const model::VoxelIndex first = model::Brick::Of(model.bounds().min);
  const model::VoxelIndex end = model::Brick::Of(model.bounds().max);
  for (int z = first.z(); z < end.z(); ++z) {
    for (int y = first.y(); y < end.y(); ++y) {
      for (int x = first.x(); x < end.x(); ++x) {
        const model::VoxelIndex brick(x, y, z);
        emptied.by_page[model::KeyOf(model::BrickPage::Of(brick))].Set(
            model::Brick::LocalOf(brick));
      }
    }
  }
  for (const model::BrickAt& at : changed) {
    emptied.by_page[model::KeyOf(model::BrickPage::Of(at.brick))].Clear(
        model::Brick::LocalOf(at.brick));
  }
  return {model, model.version(), changed, model.stations(), emptied};
}

}  // namespace

Expectation::Expectation(const model::PlanningView& model, model::PlanningView view,
                         std::vector<ExpectedFloor> floors, std::vector<Room> rooms,
                         absl::flat_hash_set<std::pair<int, int>> glimpsed,
                         absl::flat_hash_set<std::pair<int, int>> by_prior,
                         parallel::Parallel& parallel)
    : model_(model),
      view_(std::move(view)),
      standing_(MeasuredAlone(view_, parallel)),
      floors_(std::move(floors)),
      rooms_(std::move(rooms)),
      glimpsed_(std::move(glimpsed)),
      by_prior_(std::move(by_prior)) {}

absl::StatusOr<std::shared_ptr<const Expectation>> Expectation::Of(
    const model::PlanningView& model, const FloorMap& floor, const Openings& openings,
    std::span<const RejectedPlace> rejected, const ExpectedSite* site,
    const sensor::ScannerModel& scanner, parallel::Parallel& parallel,
    const parallel::Cancellation& cancelled) {
  absl::flat_hash_set<Column> by_prior;
  if (site != nullptr) {
    ForEachShown(model, *site,
                 [&](const model::VoxelIndex& v, const model::Brick& /*brick*/,
                     const std::optional<size_t>& /*surface*/) { by_prior.emplace(v.x(), v.y()); });
  }
  std::vector<BehindDoorway> behind =
      RoomsBehindDoorways(model, openings, rejected, site, cancelled);
  std::vector<Room> rooms;
  std::vector<ExpectedFloor> floors;
  absl::flat_hash_set<std::pair<int, int>> glimpsed;
  BrickEdit edit(model);
  for (BehindDoorway& doorway : behind) {
    if (cancelled.Requested()) return absl::CancelledError("expectation");
    const Opening& opening = openings.openings[doorway.opening];
    const auto in_vain = LookedIntoInVain(model, opening, doorway, scanner, cancelled);
    if (!in_vain.ok()) return in_vain.status();
    if (*in_vain) continue;
    doorway.room.Apply(doorway.columns, edit, floors);
    if (opening.glimpsed) {
      ForEachColumnWithWalls(doorway.columns, [&](const Column& at) { glimpsed.emplace(at); });
    }
    rooms.push_back(
        {doorway.opening, std::move(doorway.columns), static_cast<float>(opening.centre.z())});
  }
  const auto flights = FindFlights(model, floor, cancelled);
  if (!flights.has_value()) return absl::CancelledError("expectation");
  for (const Flight& flight : *flights) ExpectStorey(model, floor, flight, edit);
  if (site != nullptr) AddSite(model, *site, by_prior, edit, floors);
  std::vector<model::BrickAt> changed = edit.Bricks();
  if (site != nullptr) {
    const model::PlanningView expected(model, model.version(), changed, model.stations());
    // A prior shows whole buildings; of most of them nobody has seen anything yet.
    const auto looked_at = LookedAtInVain(model, expected, SeenAround(model, changed),
                                          model.stations(), scanner, cancelled);
    if (!looked_at.ok()) return looked_at.status();
    for (const auto& [voxel, surface] : *looked_at) {
      model::SurfaceVoxel given_up = surface;
      given_up.given_up = true;
      edit.SetSurface(voxel, given_up);
    }
    changed = edit.Bricks();
  }
  return absl::WrapUnique<const Expectation>(new Expectation(
      model, model::PlanningView(model, model.version(), changed, model.stations()),
      std::move(floors), std::move(rooms), std::move(glimpsed), std::move(by_prior), parallel));
}

std::optional<size_t> Expectation::Behind(const Eigen::Vector3d& place) const {
  const Eigen::Vector2i at = view_.At(place).head<2>();
  for (const Room& room : rooms_) {
    const double over = place.z() - static_cast<double>(room.floor);
    if (over < 0 || over > kCeiling) continue;
    if (std::find(room.columns.begin(), room.columns.end(), at) != room.columns.end()) {
      return room.opening;
    }
  }
  return std::nullopt;
}

}  // namespace vantage::planning
