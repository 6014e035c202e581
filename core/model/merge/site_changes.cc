#include "core/model/merge/site_changes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <utility>

#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/empty_around.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/brick_pages.h"
#include "core/model/view/voxel.h"

namespace vantage::model {
namespace {

// m2: a hand is smaller, a stool, a person and a door are larger. What noise leaves floating at
// edges is smaller at voxels of up to 5 cm; at larger ones it is so many voxels that count.
constexpr double kLeastArea = 0.1;
constexpr double kFewestVoxels = 20;
constexpr size_t kMostChanges = 20;

using Cube = std::array<int, 3>;
// Voxels that changed alike: the kind, and the place of the newest scan that shows it otherwise.
using Alike = std::pair<SiteChange::Kind, size_t>;
using ChangedVoxels = std::map<Alike, std::set<Cube>>;

BrickNeighbourhood<LayerBrick> Around(const ScanLayer& layer, const VoxelIndex& brick) {
  return BrickNeighbourhood<LayerBrick>(brick, [&](const VoxelIndex& b) { return layer.Find(b); });
}

// The voxels of a brick of the model that are known to be empty, and those that hold surface.
struct KnownVoxels {
  BrickMask empty;
  BrickMask surface;
};
KnownVoxels KnownIn(const Brick& brick) {
  KnownVoxels known;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const VoxelState state = brick.state[static_cast<size_t>(local)];
    if (state == VoxelState::kEmpty) known.empty.Set(local);
    if (state == VoxelState::kTrueSurface || state == VoxelState::kAbsorbed) {
      known.surface.Set(local);
    }
  }
  return known;
}

// True where known surface lies on the way: what is seen there is an image in a mirror, or the
// edge of something else. `from`: m, model frame.
bool Hidden(const PlanningView& model, const Eigen::Vector3d& from, const VoxelIndex& to) {
  const double h = model.voxel_size();
  const Eigen::Vector3d way = model.Centre(to) - from;
  // The last three voxels are its own neighbourhood.
  const double end = way.norm() - 3 * h;
  for (double along = 2 * h; along < end; along += 0.5 * h) {
    const VoxelIndex at = model.At(from + along / way.norm() * way);
    if (model.State(at) == VoxelState::kTrueSurface) return true;
  }
  return false;
}

// Of surface in voxels that were known to be empty, the newest scan that saw through them.
void AddCame(const PlanningView& model, const VoxelIndex& brick, BrickMask left,
             const ScanLayer& layer, std::span<const ScanLayer* const> before,
             ChangedVoxels& changed) {
  for (size_t k = 0; k < before.size() && left.Any(); ++k) {
    const LayerBrick* other = before[k]->Find(brick);
    if (other == nullptr) continue;
    const BrickMask candidates = left & other->empty;
    if (!candidates.Any()) continue;
    const BrickNeighbourhood<LayerBrick> around = Around(*before[k], brick);
    candidates.ForEach([&](int local) {
      if (!EmptyAllAround(around, local)) return;
      left.Clear(local);
      const VoxelIndex at = PlanningView::Global(brick, local);
      if (Hidden(model, layer.T_model_scan.translation(), at)) return;
      changed[{SiteChange::Kind::kCame, k}].insert({at.x(), at.y(), at.z()});
    });
  }
}

// Of voxels with surface that `layer` saw empty, the newest scan that shows it.
void AddGone(const PlanningView& model, const VoxelIndex& brick, BrickMask left,
             const ScanLayer& layer, std::span<const ScanLayer* const> before,
             ChangedVoxels& changed) {
  const BrickNeighbourhood<LayerBrick> around = Around(layer, brick);
  for (size_t k = 0; k < before.size() && left.Any(); ++k) {
    const LayerBrick* other = before[k]->Find(brick);
    if (other == nullptr) continue;
    (left & other->surface).ForEach([&](int local) {
      left.Clear(local);
      if (!EmptyAllAround(around, local)) return;
      const VoxelIndex at = PlanningView::Global(brick, local);
      if (Hidden(model, before[k]->T_model_scan.translation(), at) ||
          Hidden(model, layer.T_model_scan.translation(), at)) {
        return;
      }
      changed[{SiteChange::Kind::kGone, k}].insert({at.x(), at.y(), at.z()});
    });
  }
}

// Takes those that hang together with the first, a voxel apart at most, out of `voxels`.
std::vector<Cube> TakeFirstPiece(std::set<Cube>& voxels) {
  std::vector<Cube> piece = {*voxels.begin()};
  voxels.erase(voxels.begin());
  constexpr int kApart = 2;
  for (size_t next = 0; next < piece.size(); ++next) {
    const Cube at = piece[next];
    for (int z = -kApart; z <= kApart; ++z) {
      for (int y = -kApart; y <= kApart; ++y) {
        for (int x = -kApart; x <= kApart; ++x) {
          const auto found = voxels.find({at[0] + x, at[1] + y, at[2] + z});
          if (found == voxels.end()) continue;
          piece.push_back(*found);
          voxels.erase(found);
        }
      }
    }
  }
  return piece;
}

// The largest number of columns of voxels along an axis that a piece fills.
size_t OutlineOf(const std::vector<Cube>& piece) {
  size_t largest = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    std::set<std::pair<int, int>> columns;
    for (const Cube& at : piece) columns.emplace(at[(axis + 1) % 3], at[(axis + 2) % 3]);
    largest = std::max(largest, columns.size());
  }
  return largest;
}

SiteChange ChangeOf(const std::vector<Cube>& piece, double voxel_size) {
  SiteChange change;
  for (const Cube& at : piece) {
    const Eigen::Vector3d low = voxel_size * Eigen::Vector3d(at[0], at[1], at[2]);
    change.centre += low + Eigen::Vector3d::Constant(0.5 * voxel_size);
    change.box.extend(low);
    change.box.extend(low + Eigen::Vector3d::Constant(voxel_size));
  }
  change.centre /= static_cast<double>(piece.size());
  change.area = static_cast<double>(OutlineOf(piece)) * voxel_size * voxel_size;
  return change;
}

}  // namespace

std::vector<SiteChange> FindSiteChanges(
    const PlanningView& model, const std::string& of,
    const std::map<std::string, std::unique_ptr<ScanLayer>>& layers,
    std::span<const std::string> order) {
  std::vector<const ScanLayer*> before;  // the newest first
  std::vector<std::string> names;
  for (auto it = order.rbegin(); it != order.rend(); ++it) {
    if (*it == of) continue;
    before.push_back(layers.at(*it).get());
    names.push_back(*it);
  }
  const ScanLayer& layer = *layers.at(of);
  ChangedVoxels changed;
  layer.bricks.ForEach([&](BrickKey key, const LayerBrick& own) {
    const VoxelIndex brick = BrickOf(key);
    const BrickPage* page = model.Page(BrickPage::Of(brick));
    const Brick* contents = page == nullptr ? nullptr : page->Find(brick);
    // Most bricks are empty to both.
    if (contents == nullptr || (!own.surface.Any() && contents->surface.size() == 0)) return;
    const KnownVoxels known = KnownIn(*contents);
    const BrickMask came = own.surface & known.empty;
    const BrickMask gone = own.empty & known.surface;
    if (came.Any()) AddCame(model, brick, came, layer, before, changed);
    if (gone.Any()) AddGone(model, brick, gone, layer, before, changed);
  });
  const double voxel_size = model.voxel_size();
  const double least = std::max(kLeastArea, kFewestVoxels * voxel_size * voxel_size);
  std::vector<SiteChange> changes;
  for (auto& [alike, voxels] : changed) {
    while (!voxels.empty()) {
      SiteChange change = ChangeOf(TakeFirstPiece(voxels), voxel_size);
      if (change.area < least) continue;
      change.kind = alike.first;
      change.since = names[alike.second];
      changes.push_back(std::move(change));
    }
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const SiteChange& a, const SiteChange& b) { return a.area > b.area; });
  if (changes.size() > kMostChanges) changes.resize(kMostChanges);
  return changes;
}

}  // namespace vantage::model
