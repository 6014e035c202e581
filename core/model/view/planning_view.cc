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
  pages_ = WithChanges({}, bricks, copied_pages_);
  Index();
}

PlanningView::PlanningView(const PlanningView& before, uint64_t version,
                           std::span<const BrickAt> changed, std::vector<Station> stations)
    : voxel_size_(before.voxel_size_), version_(version), stations_(std::move(stations)) {
  pages_ = WithChanges(before.pages_, changed, copied_pages_);
  Index();
}

const BrickPage* PlanningView::FindPage(const VoxelIndex& page) const {
  const BrickKey key = KeyOf(page);
  const auto it = std::lower_bound(pages_.begin(), pages_.end(), key,
                                   [](const std::shared_ptr<const BrickPage>& at, BrickKey wanted) {
                                     return KeyOf(at->coordinates()) < wanted;
                                   });
  return it != pages_.end() && KeyOf((*it)->coordinates()) == key ? it->get() : nullptr;
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
    surface_count_ += page->surface_count();
  }
  bounds_ = {first * Brick::kSide, (last + VoxelIndex::Ones()) * Brick::kSide};
  first_page_ = BrickPage::Of(first);
  table_size_ = BrickPage::Of(last) - first_page_ + VoxelIndex::Ones();
  const size_t places = static_cast<size_t>(table_size_.x()) *
                        static_cast<size_t>(table_size_.y()) * static_cast<size_t>(table_size_.z());
  // The table never costs more than the pages do, or a few megabytes.
  constexpr size_t kPlacesPerPage = 64;
  constexpr size_t kFewPlaces = size_t{1} << 20;
  if (places > std::max(kFewPlaces, kPlacesPerPage * pages_.size())) return;
  table_.assign(places, nullptr);
  for (const std::shared_ptr<const BrickPage>& page : pages_) {
    table_[TableIndex(page->coordinates())] = page.get();
  }
}

}  // namespace vantage::model
