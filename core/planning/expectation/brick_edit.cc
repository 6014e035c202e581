#include "core/planning/expectation/brick_edit.h"

#include <cstddef>
#include <utility>

namespace vantage::planning {

model::VoxelState BrickEdit::State(const model::VoxelIndex& v) const {
  const model::VoxelIndex brick = model::Brick::Of(v);
  const auto of_brick = changes_.find({brick.z(), brick.y(), brick.x()});
  if (of_brick == changes_.end()) return model_.State(v);
  const auto change = of_brick->second.find(model::Brick::LocalOf(v));
  return change == of_brick->second.end() ? model_.State(v) : change->second.state;
}

std::vector<model::BrickAt> BrickEdit::Bricks() const {
  std::vector<model::BrickAt> bricks;
  bricks.reserve(changes_.size());
  for (const auto& [key, changes] : changes_) {
    const model::VoxelIndex at(std::get<2>(key), std::get<1>(key), std::get<0>(key));
    auto edited = std::make_shared<model::Brick>();
    for (int local = 0; local < model::Brick::kVoxels; ++local) {
      const model::VoxelIndex v = model::PlanningView::Global(at, local);
      const auto change = changes.find(local);
      const bool changed = change != changes.end();
      const model::VoxelState state = changed ? change->second.state : model_.State(v);
      edited->state[static_cast<size_t>(local)] = state;
      if (!model::HasArea(state)) continue;
      edited->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
      if (changed) {
        edited->surface.push_back(*change->second.surface);
        continue;
      }
      edited->surface.push_back(*model_.Surface(v));
      for (const model::Dropout& dropout : model_.Dropouts(v)) edited->dropouts.push_back(dropout);
    }
    bricks.push_back({at, std::move(edited)});
  }
  return bricks;
}

}  // namespace vantage::planning
