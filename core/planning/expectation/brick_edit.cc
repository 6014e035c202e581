#include "core/planning/expectation/brick_edit.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <tuple>

namespace vantage::planning {

model::VoxelState BrickEdit::State(const model::VoxelIndex& v) const {
  const auto it = by_brick_.find(model::KeyOf(model::Brick::Of(v)));
  const int local = model::Brick::LocalOf(v);
  if (it == by_brick_.end() || !it->second.changed.Has(local)) return model_.State(v);
  return it->second.state[static_cast<size_t>(local)];
}

BrickEdit::Changes& BrickEdit::Change(const model::VoxelIndex& v, model::VoxelState state) {
  const model::VoxelIndex brick = model::Brick::Of(v);
  Changes& changes = by_brick_[model::KeyOf(brick)];
  changes.brick = brick;
  const int local = model::Brick::LocalOf(v);
  changes.changed.Set(local);
  changes.state[static_cast<size_t>(local)] = state;
  return changes;
}

void BrickEdit::SetEmpty(const model::VoxelIndex& v) { Change(v, model::VoxelState::kEmpty); }

void BrickEdit::EmptyUnknown(const model::VoxelIndex& v) {
  if (NothingKnown(State(v))) SetEmpty(v);
}

bool BrickEdit::CloseUnknown(const model::VoxelIndex& v, const Eigen::Vector3i& normal,
                             std::optional<double> z) {
  if (!NothingKnown(State(v))) return false;
  const double voxel = model_.voxel_size();
  model::SurfaceVoxel surface;
  surface.centroid = model_.Centre(v).cast<float>();
  if (z.has_value()) surface.centroid.z() = static_cast<float>(*z);
  surface.normal = normal.cast<float>();
  surface.area = static_cast<float>(voxel * voxel);
  SetSurface(v, surface);
  return true;
}

void BrickEdit::SetSurface(const model::VoxelIndex& v, const model::SurfaceVoxel& surface) {
  Change(v, model::VoxelState::kTrueSurface)
      .surfaces.emplace_back(model::Brick::LocalOf(v), surface);
}

model::BrickAt BrickEdit::Edited(const Changes& changes) const {
  std::array<const model::SurfaceVoxel*, model::Brick::kVoxels> own{};
  for (const auto& [local, surface] : changes.surfaces) own[static_cast<size_t>(local)] = &surface;
  auto edited = std::make_shared<model::Brick>();
  for (int local = 0; local < model::Brick::kVoxels; ++local) {
    const auto at = static_cast<size_t>(local);
    const model::VoxelIndex v = model::PlanningView::Global(changes.brick, local);
    const bool changed = changes.changed.Has(local);
    edited->state[at] = changed ? changes.state[at] : model_.State(v);
    if (!model::HasArea(edited->state[at])) continue;
    edited->surface_mask[at / 64] |= uint64_t{1} << (local % 64);
    edited->surface.push_back(changed ? *own[at] : model_.Surface(v).value());
    if (changed) continue;
    for (const model::Dropout& dropout : model_.Dropouts(v)) edited->dropouts.push_back(dropout);
  }
  return {changes.brick, std::move(edited)};
}

std::vector<model::BrickAt> BrickEdit::Bricks() const {
  std::vector<model::BrickAt> bricks;
  bricks.reserve(by_brick_.size());
  for (const auto& [key, changes] : by_brick_) bricks.push_back(Edited(changes));
  std::sort(bricks.begin(), bricks.end(), [](const model::BrickAt& a, const model::BrickAt& b) {
    return std::tuple(a.brick.z(), a.brick.y(), a.brick.x()) <
           std::tuple(b.brick.z(), b.brick.y(), b.brick.x());
  });
  return bricks;
}

}  // namespace vantage::planning
