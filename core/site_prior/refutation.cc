#include "core/site_prior/refutation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "core/model/view/brick_key.h"
#include "core/site_prior/walls.h"

namespace vantage::site_prior {
namespace {

// So much of a brick has to be gone or new, m2, before what is around is dropped: less is the
// border of something.
constexpr double kLeastRefuted = 0.03;
constexpr double kDroppedAround = 3;  // times the accuracy, and a brick at least
constexpr float kFacesAlike = 0.5F;   // cosine
// Voxels aside of the normal: two rasters of one plane differ by as much. What is farther aside is
// no surface that lies a little off, but where it goes on.
constexpr double kRasterAside = 1;
constexpr size_t kSurfaceBetweenLooks = 512;  // voxels with surface, or bricks
// Of voxels that a reach is: a tenth and a twentieth of a metre make three, and not a bit more.
constexpr double kRounding = 1e-9;

// Asks now and then whether the work is wanted.
class Looks {
 public:
  explicit Looks(const parallel::Cancellation& cancelled) : cancelled_(cancelled) {}
  // True from when it was seen not to be.
  bool Stopped() {
    if (!stopped_ && ++since_ >= kSurfaceBetweenLooks) {
      since_ = 0;
      stopped_ = cancelled_.Requested();
    }
    return stopped_;
  }

 private:
  const parallel::Cancellation& cancelled_;
  size_t since_ = kSurfaceBetweenLooks;  // the first is at once
  bool stopped_ = false;
};

bool IsMeasured(model::VoxelState state) {
  return state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
}

// Looks for surface of a view around a voxel.
class Around {
 public:
  Around(const model::PlanningView& view, double accuracy)
      : view_(view),
        reach_(std::max(1, static_cast<int>(std::ceil(accuracy / view.voxel_size() - kRounding)))) {
  }

  bool AnySurface(const model::VoxelIndex& v) const {
    return Any(v,
               [](const model::VoxelIndex&, model::VoxelState state) { return IsMeasured(state); });
  }
  // Surface that faces alike, before or behind.
  bool Same(const model::VoxelIndex& v, const Eigen::Vector3f& normal) const {
    return Any(v, [&](const model::VoxelIndex& at, model::VoxelState state) {
      if (state != model::VoxelState::kTrueSurface) return false;
      const Eigen::Vector3d off = (at - v).cast<double>();
      const double along = off.dot(normal.cast<double>());
      if (off.squaredNorm() - along * along > kRasterAside * kRasterAside + kRounding) return false;
      return view_.Surface(at)->normal.dot(normal) > kFacesAlike;
    });
  }

 private:
  template <typename Fn>
  bool Any(const model::VoxelIndex& v, Fn&& fn) const {
    for (int dz = -reach_; dz <= reach_; ++dz) {
      for (int dy = -reach_; dy <= reach_; ++dy) {
        for (int dx = -reach_; dx <= reach_; ++dx) {
          const model::VoxelIndex at = v + model::VoxelIndex(dx, dy, dz);
          if (fn(at, view_.State(at))) return true;
        }
      }
    }
    return false;
  }

  const model::PlanningView& view_;
  const int reach_;  // voxels
};

bool OverFurniture(const Floors& floors, const model::SurfaceVoxel& surface) {
  if (!IsUpright(surface.normal)) return false;
  const auto z = static_cast<double>(surface.centroid.z());
  const std::optional<double> floor = floors.Under(z);
  return floor.has_value() && z >= *floor + kWallsFrom && z <= *floor + kWallsTo;
}

using BrickSet = absl::flat_hash_set<model::BrickKey>;

// The bricks in which something is refuted, and those around.
BrickSet Dropped(const absl::flat_hash_map<model::BrickKey, double>& refuted, double accuracy,
                 double voxel, Looks& looks) {
  const int reach = std::max(
      1, static_cast<int>(
             std::ceil(kDroppedAround * accuracy / (voxel * model::Brick::kSide) - kRounding)));
  BrickSet dropped;
  for (const auto& [key, area] : refuted) {
    if (looks.Stopped()) break;
    if (area < kLeastRefuted) continue;
    const model::VoxelIndex brick = model::BrickOf(key);
    for (int dz = -reach; dz <= reach; ++dz) {
      for (int dy = -reach; dy <= reach; ++dy) {
        for (int dx = -reach; dx <= reach; ++dx) {
          dropped.insert(model::KeyOf(brick + model::VoxelIndex(dx, dy, dz)));
        }
      }
    }
  }
  return dropped;
}

// Cells of two voxels a side, 64 to a brick: bit x + 4 y + 16 z stands for one. What is narrower is
// no way: measured surface has holes.
constexpr int kCellsOfSide = model::Brick::kSide / 2;
static_assert(kCellsOfSide == 4, "a brick's cells are the bits of a word");
using CellMask = uint64_t;

struct AxisOfCells {
  int step;        // from a cell's bit to that of the next one along the axis
  CellMask first;  // the cells at the brick's lower side
  CellMask last;   // and at its upper side
};
constexpr std::array<AxisOfCells, 3> kAxes = {{{1, 0x1111111111111111, 0x8888888888888888},
                                               {4, 0x000f000f000f000f, 0xf000f000f000f000},
                                               {16, 0x000000000000ffff, 0xffff000000000000}}};

// The cells, by brick, that hang together with where a scanner stood by space of which `free(v)`
// says that it is free.
template <typename Free>
absl::flat_hash_map<model::BrickKey, CellMask> ReachedFrom(const model::PlanningView& model,
                                                           const model::PlanningView& space,
                                                           Looks& looks, Free&& free) {
  const auto free_cells = [&](const model::VoxelIndex& brick) {
    CellMask cells = 0;
    for (int bit = 0; bit < 64; ++bit) {
      const model::VoxelIndex low =
          brick * model::Brick::kSide + 2 * model::VoxelIndex(bit % 4, bit / 4 % 4, bit / 16);
      bool all = true;
      for (int corner = 0; corner < 8 && all; ++corner) {
        all = free(low + model::VoxelIndex(corner & 1, (corner >> 1) & 1, corner >> 2));
      }
      cells |= all ? CellMask{1} << bit : 0;
    }
    return cells;
  };
  absl::flat_hash_map<model::BrickKey, CellMask> free_of;
  absl::flat_hash_map<model::BrickKey, CellMask> reached;
  std::vector<model::VoxelIndex> front;
  const model::VoxelIndex low = model::Brick::Of(space.bounds().min);
  const model::VoxelIndex high = model::Brick::Of(space.bounds().max);
  const auto visit = [&](const model::VoxelIndex& brick, CellMask cells) {
    if (cells == 0 || (brick.array() < low.array()).any() || (brick.array() > high.array()).any()) {
      return;
    }
    const model::BrickKey key = model::KeyOf(brick);
    const auto [known, fresh] = free_of.try_emplace(key, 0);
    if (fresh) known->second = free_cells(brick);
    CellMask& there = reached[key];
    const CellMask added = cells & known->second & ~there;
    if (added == 0) return;
    there |= added;
    front.push_back(brick);
  };
  for (const model::Station& station : model.stations()) {
    visit(model::Brick::Of(model.At(station.position)), ~CellMask{0});
  }
  while (!front.empty() && !looks.Stopped()) {
    const model::VoxelIndex brick = front.back();
    front.pop_back();
    const model::BrickKey key = model::KeyOf(brick);
    const CellMask open = free_of.at(key);
    CellMask cells = reached.at(key);
    for (CellMask before = 0; before != cells;) {
      before = cells;
      for (const AxisOfCells& axis : kAxes) {
        cells |= ((cells & ~axis.last) << axis.step) | ((cells & ~axis.first) >> axis.step);
      }
      cells &= open;
    }
    reached[key] = cells;
    for (int k = 0; k < 3; ++k) {
      const AxisOfCells& axis = kAxes[static_cast<size_t>(k)];
      const int across = (kCellsOfSide - 1) * axis.step;
      model::VoxelIndex next = brick;
      next[k] += 1;
      visit(next, (cells & axis.last) >> across);
      next[k] -= 2;
      visit(next, (cells & axis.first) << across);
    }
  }
  return reached;
}

// Adds to `dropped` what new walls cut off: what hangs together with the stations by the prior
// alone, and no more by what is known and, where nothing is, by the prior.
void DropCutOff(const model::PlanningView& model, const model::PlanningView& space, Looks& looks,
                BrickSet& dropped) {
  const auto before =
      ReachedFrom(model, space, looks, [&](const model::VoxelIndex& v) { return space.Empty(v); });
  const auto after = ReachedFrom(model, space, looks, [&](const model::VoxelIndex& v) {
    const model::VoxelState known = model.State(v);
    if (known == model::VoxelState::kEmpty) return true;
    return !IsMeasured(known) && space.Empty(v);
  });
  for (const auto& [key, cells] : before) {
    const auto it = after.find(key);
    if (cells != 0 && (it == after.end() || it->second == 0)) dropped.insert(key);
  }
}

// A brick without surface that was measured already; the same where there is none.
std::shared_ptr<const model::Brick> Unmeasured(const model::PlanningView& model,
                                               const Around& measured, const model::BrickAt& at,
                                               Looks& looks) {
  std::vector<std::pair<int, model::SurfaceVoxel>> kept;
  bool changed = false;
  auto brick = std::make_shared<model::Brick>();
  brick->state = at.contents->state;
  size_t rank = 0;
  for (size_t word = 0; word < at.contents->surface_mask.size(); ++word) {
    for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1) {
      if (looks.Stopped()) return at.contents;
      const int local = static_cast<int>(word) * 64 + std::countr_zero(bits);
      const model::SurfaceVoxel surface = at.contents->surface[rank++];
      const model::VoxelIndex v = model::PlanningView::Global(at.brick, local);
      const model::VoxelState known = model.State(v);
      const bool open = known == model::VoxelState::kUnknown || model::IsFalseSurface(known);
      if (open && measured.Same(v, surface.normal)) {
        brick->state[static_cast<size_t>(local)] = model::VoxelState::kUnknown;
        changed = true;
        continue;
      }
      brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
      brick->surface.push_back(surface);
    }
  }
  if (!changed) return at.contents;
  return brick;
}

}  // namespace

absl::StatusOr<Refutation> Refute(const model::PlanningView& model,
                                  const model::PlanningView& space, double accuracy,
                                  const parallel::Cancellation& cancelled) {
  const double voxel = model.voxel_size();
  const double face = voxel * voxel;
  const Around measured(model, accuracy + voxel);
  const Around expected(space, accuracy + voxel);
  const Floors floors(model);
  double agreeing = 0;
  double gone = 0;
  double added = 0;
  absl::flat_hash_map<model::BrickKey, double> refuted;  // m2
  Looks looks(cancelled);
  space.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState, const model::SurfaceVoxel& surface) {
        if (looks.Stopped()) return;
        const model::VoxelState known = model.State(v);
        if (known == model::VoxelState::kUnknown) return;
        const bool there = measured.AnySurface(v);
        const bool missing = !there && known == model::VoxelState::kEmpty;
        if (missing) refuted[model::KeyOf(model::Brick::Of(v))] += face;
        if (!there && !missing) return;
        if (OverFurniture(floors, surface)) (there ? agreeing : gone) += face;
      });
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (looks.Stopped() || state != model::VoxelState::kTrueSurface) return;
        if (!space.Empty(v) || !OverFurniture(floors, surface) || expected.AnySurface(v)) return;
        refuted[model::KeyOf(model::Brick::Of(v))] += face;
        added += face;
      });
  BrickSet dropped = Dropped(refuted, accuracy, voxel, looks);
  DropCutOff(model, space, looks, dropped);
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : space.bricks()) {
    if (looks.Stopped()) break;
    if (dropped.contains(model::KeyOf(at.brick))) continue;
    bricks.push_back({at.brick, Unmeasured(model, measured, at, looks)});
  }
  if (looks.Stopped()) return absl::CancelledError("site prior");
  return Refutation{model::PlanningView(voxel, space.version(), std::move(bricks), {}), agreeing,
                    gone, added};
}

}  // namespace vantage::site_prior
