// Bricks of a model with changed voxels.
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/planning_view.h"

namespace vantage::planning {

// Where a model knows neither what is nor that nothing is.
inline bool NothingKnown(model::VoxelState state) {
  return state == model::VoxelState::kUnknown || model::IsFalseSurface(state);
}

// Collects changes of voxels. The model outlives it.
class BrickEdit {
 public:
  explicit BrickEdit(const model::PlanningView& model) : model_(model) {}

  // What the voxel is with the changes so far.
  model::VoxelState State(const model::VoxelIndex& v) const;
  void SetEmpty(const model::VoxelIndex& v);
  // The same where nothing is known.
  void EmptyUnknown(const model::VoxelIndex& v);
  // Where nothing is known, surface that faces along `normal` (one axis), at no density: through
  // the voxel's middle, or at `z` (m). False elsewhere.
  bool CloseUnknown(const model::VoxelIndex& v, const Eigen::Vector3i& normal,
                    std::optional<double> z = std::nullopt);
  // `surface.centroid` lies in the voxel.
  void SetSurface(const model::VoxelIndex& v, const model::SurfaceVoxel& surface);
  // The changed bricks, by z, y, x.
  std::vector<model::BrickAt> Bricks() const;

 private:
  struct Changes {
    model::VoxelIndex brick;
    model::BrickMask changed;
    std::array<model::VoxelState, model::Brick::kVoxels> state{};  // of those changed
    // By place in the brick; of several for one voxel the last counts, while it has area.
    std::vector<std::pair<int, model::SurfaceVoxel>> surfaces;
  };

  Changes& Change(const model::VoxelIndex& v, model::VoxelState state);
  model::BrickAt Edited(const Changes& changes) const;

  const model::PlanningView& model_;
  absl::flat_hash_map<model::BrickKey, Changes> by_brick_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_BRICK_EDIT_H_
