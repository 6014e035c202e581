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
constexpr size_t kBricksBetweenLooks = 256;

bool IsMeasured(model::VoxelState state) {
  return state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
}

// Looks for surface of a view around a voxel.
class Around {
 public:
  Around(const model::PlanningView& view, double accuracy)
      : view_(view),
        reach_(std::max(1, static_cast<int>(std::ceil(accuracy / view.voxel_size())))) {}

  bool AnySurface(const model::VoxelIndex& v) const {
    return Any(v,
               [](const model::VoxelIndex&, model::VoxelState state) { return IsMeasured(state); });
  }
  // Surface that faces alike.
  bool Same(const model::VoxelIndex& v, const Eigen::Vector3f& normal) const {
    return Any(v, [&](const model::VoxelIndex& at, model::VoxelState state) {
      if (state != model::VoxelState::kTrueSurface) return false;
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

bool OverFurniture(const model::PlanningView& model, const model::SurfaceVoxel& surface) {
  if (!IsUpright(surface.normal)) return false;
  const auto z = static_cast<double>(surface.centroid.z());
  const std::optional<double> floor = FloorUnder(model, z);
  return floor.has_value() && z >= *floor + kWallsFrom && z <= *floor + kWallsTo;
}

using BrickSet = absl::flat_hash_set<model::BrickKey>;

// The bricks in which something is refuted, and those around.
BrickSet Dropped(const absl::flat_hash_map<model::BrickKey, double>& refuted, double accuracy,
                 double voxel) {
  const int reach = std::max(
      1, static_cast<int>(std::ceil(kDroppedAround * accuracy / (voxel * model::Brick::kSide))));
  BrickSet dropped;
  for (const auto& [key, area] : refuted) {
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

// The bricks that hang together with where a scanner stood by space that `free(v)` says is free.
template <typename Free>
BrickSet ReachedFrom(const model::PlanningView& model, const model::PlanningView& space,
                     Free&& free) {
  constexpr int kLeastWay =
      6;  // pairs of voxels of a face: a hand's breadth, the height of a brick
  BrickSet reached;
  std::vector<model::VoxelIndex> front;
  const auto visit = [&](const model::VoxelIndex& brick) {
    if (reached.insert(model::KeyOf(brick)).second) front.push_back(brick);
  };
  for (const model::Station& station : model.stations()) {
    visit(model::Brick::Of(model.At(station.position)));
  }
  const model::VoxelIndex low = model::Brick::Of(space.bounds().min);
  const model::VoxelIndex high = model::Brick::Of(space.bounds().max);
  while (!front.empty()) {
    const model::VoxelIndex brick = front.back();
    front.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int way : {-1, 1}) {
        model::VoxelIndex next = brick;
        next[axis] += way;
        if ((next.array() < low.array()).any() || (next.array() > high.array()).any()) continue;
        if (reached.contains(model::KeyOf(next))) continue;
        int pairs = 0;
        for (int i = 0; i < model::Brick::kSide && pairs < kLeastWay; ++i) {
          for (int k = 0; k < model::Brick::kSide && pairs < kLeastWay; ++k) {
            model::VoxelIndex v = brick * model::Brick::kSide;
            v[axis] += way > 0 ? model::Brick::kSide - 1 : 0;
            v[(axis + 1) % 3] += i;
            v[(axis + 2) % 3] += k;
            model::VoxelIndex w = v;
            w[axis] += way;
            pairs += free(v) && free(w) ? 1 : 0;
          }
        }
        if (pairs >= kLeastWay) visit(next);
      }
    }
  }
  return reached;
}

// Adds to `dropped` what new walls cut off: what hangs together with the stations by the prior
// alone, and no more by what is known and, where nothing is, by the prior.
void DropCutOff(const model::PlanningView& model, const model::PlanningView& space,
                BrickSet& dropped) {
  const BrickSet before =
      ReachedFrom(model, space, [&](const model::VoxelIndex& v) { return space.Empty(v); });
  const BrickSet after = ReachedFrom(model, space, [&](const model::VoxelIndex& v) {
    const model::VoxelState known = model.State(v);
    if (known == model::VoxelState::kEmpty) return true;
    return !IsMeasured(known) && space.Empty(v);
  });
  for (const model::BrickKey key : before) {
    if (!after.contains(key)) dropped.insert(key);
  }
}

// A brick without surface that was measured already; the same where there is none.
std::shared_ptr<const model::Brick> Unmeasured(const model::PlanningView& model,
                                               const Around& measured, const model::BrickAt& at) {
  std::vector<std::pair<int, model::SurfaceVoxel>> kept;
  bool changed = false;
  auto brick = std::make_shared<model::Brick>();
  brick->state = at.contents->state;
  size_t rank = 0;
  for (size_t word = 0; word < at.contents->surface_mask.size(); ++word) {
    for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1) {
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
  double agreeing = 0;
  double gone = 0;
  double added = 0;
  absl::flat_hash_map<model::BrickKey, double> refuted;  // m2
  size_t until_look = 0;
  bool stopped = false;
  const auto look = [&] {
    if (until_look-- != 0) return;
    until_look = kBricksBetweenLooks * model::Brick::kVoxels / 8;
    stopped |= cancelled.Requested();
  };
  space.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState, const model::SurfaceVoxel& surface) {
        look();
        if (stopped) return;
        const model::VoxelState known = model.State(v);
        if (known == model::VoxelState::kUnknown) return;
        const bool there = measured.AnySurface(v);
        const bool missing = !there && known == model::VoxelState::kEmpty;
        if (missing) refuted[model::KeyOf(model::Brick::Of(v))] += face;
        if (!there && !missing) return;
        if (OverFurniture(model, surface)) (there ? agreeing : gone) += face;
      });
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        look();
        if (stopped || state != model::VoxelState::kTrueSurface) return;
        if (!space.Empty(v) || !OverFurniture(model, surface) || expected.AnySurface(v)) return;
        refuted[model::KeyOf(model::Brick::Of(v))] += face;
        added += face;
      });
  if (stopped) return absl::CancelledError("site prior");
  BrickSet dropped = Dropped(refuted, accuracy, voxel);
  DropCutOff(model, space, dropped);
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : space.bricks()) {
    if (dropped.contains(model::KeyOf(at.brick))) continue;
    bricks.push_back({at.brick, Unmeasured(model, measured, at)});
  }
  return Refutation{model::PlanningView(voxel, space.version(), std::move(bricks), {}), agreeing,
                    gone, added};
}

}  // namespace vantage::site_prior
