#include "core/model/view/planning_view.h"

#include <algorithm>
#include <utility>

#include "core/model/view/brick_key.h"

namespace vantage::model {

PlanningView::PlanningView(double voxel_size, uint64_t version, std::vector<BrickAt> bricks,
                           std::vector<Station> stations)
    : voxel_size_(voxel_size), version_(version), stations_(std::move(stations)) {
  const auto before = [](const BrickAt& a, const BrickAt& b) {
    return KeyOf(a.brick) < KeyOf(b.brick);
  };
  if (!std::is_sorted(bricks.begin(), bricks.end(), before)) {
    std::sort(bricks.begin(), bricks.end(), before);
  }
  pages_ = WithChanges({}, bricks, {}, copied_pages_);
  Index();
}

PlanningView::PlanningView(const PlanningView& before, uint64_t version,
                           std::span<const BrickAt> changed, std::vector<Station> stations,
                           const EmptiedBricks& emptied)
    : voxel_size_(before.voxel_size_), version_(version), stations_(std::move(stations)) {
  pages_ = WithChanges(before.pages_, changed, emptied, copied_pages_);
  Index();
}

// By page, not by brick: a site has few.
void PlanningView::Index() {
  if (pages_.empty()) return;
  VoxelIndex first = pages_.front()->first();
  VoxelIndex last = pages_.front()->last();
  for (const std::shared_ptr<const BrickPage>& page : pages_) {
    first = first.cwiseMin(page->first());
    last = last.cwiseMax(page->last());
    brick_count_ += page->size();
    surface_brick_count_ += page->partly_known();
    surface_count_ += page->surface_count();
  }
  bounds_ = {first * Brick::kSide, (last + VoxelIndex::Ones()) * Brick::kSide};
  table_ = PageTable(pages_);
}

}  // namespace vantage::model
