#include "core/model/planning_view.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace vantage {

PlanningView::PlanningView(double voxel_size, uint64_t version, std::vector<BrickAt> bricks,
                           std::vector<Stand> stands)
    : voxel_size_(voxel_size),
      version_(version),
      bricks_(std::move(bricks)),
      stands_(std::move(stands)) {
  if (bricks_.empty()) return;
  std::sort(bricks_.begin(), bricks_.end(), [](const BrickAt& a, const BrickAt& b) {
    return std::make_tuple(a.brick.z(), a.brick.y(), a.brick.x()) <
           std::make_tuple(b.brick.z(), b.brick.y(), b.brick.x());
  });
  first_brick_ = bricks_.front().brick;
  VoxelIndex last = first_brick_;
  for (const BrickAt& at : bricks_) {
    first_brick_ = first_brick_.cwiseMin(at.brick);
    last = last.cwiseMax(at.brick);
    surface_count_ += at.contents->surface.size();
  }
  table_size_ = last - first_brick_ + VoxelIndex::Ones();
  bounds_ = {first_brick_ * Brick::kSide, (last + VoxelIndex::Ones()) * Brick::kSide};
  table_.assign(static_cast<size_t>(table_size_.x()) * static_cast<size_t>(table_size_.y()) *
                    static_cast<size_t>(table_size_.z()),
                nullptr);
  for (const BrickAt& at : bricks_) {
    const VoxelIndex b = at.brick - first_brick_;
    table_[static_cast<size_t>(b.x()) +
           static_cast<size_t>(table_size_.x()) *
               (static_cast<size_t>(b.y()) + static_cast<size_t>(table_size_.y()) *
                                                 static_cast<size_t>(b.z()))] = at.contents.get();
  }
}

}  // namespace vantage
