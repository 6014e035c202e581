// Bricks of a model with changed voxels.
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_

#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "core/model/view/planning_view.h"

namespace vantage::planning {

// Collects changes of voxels. The model outlives it.
class BrickEdit {
 public:
  explicit BrickEdit(const model::PlanningView& model) : model_(model) {}

  // What the voxel is with the changes so far.
  model::VoxelState State(const model::VoxelIndex& v) const;
  void SetEmpty(const model::VoxelIndex& v) { At(v) = {model::VoxelState::kEmpty, std::nullopt}; }
  // `surface.centroid` lies in the voxel.
  void SetSurface(const model::VoxelIndex& v, const model::SurfaceVoxel& surface) {
    At(v) = {model::VoxelState::kTrueSurface, surface};
  }
  // The changed bricks, by z, y, x.
  std::vector<model::BrickAt> Bricks() const;

 private:
  struct Change {
    model::VoxelState state = model::VoxelState::kUnknown;
    std::optional<model::SurfaceVoxel> surface;
  };
  using Key = std::tuple<int, int, int>;  // z, y, x of a brick

  Change& At(const model::VoxelIndex& v) {
    const model::VoxelIndex brick = model::Brick::Of(v);
    return changes_[{brick.z(), brick.y(), brick.x()}][model::Brick::LocalOf(v)];
  }

  const model::PlanningView& model_;
  std::map<Key, std::map<int, Change>> changes_;  // by brick, by place in it
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_
