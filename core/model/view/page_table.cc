#include "core/model/view/page_table.h"

#include <algorithm>

#include "core/model/view/brick_key.h"

namespace vantage::model {
namespace {

// The table never costs more than the pages do, or a few megabytes.
constexpr size_t kPlacesPerPage = 64;
constexpr size_t kFewPlaces = size_t{1} << 20;

}  // namespace

PageTable::PageTable(std::span<const std::shared_ptr<const BrickPage>> pages) {
  if (pages.empty()) return;
  VoxelIndex last = first_ = pages.front()->coordinates();
  for (const std::shared_ptr<const BrickPage>& page : pages) {
    first_ = first_.cwiseMin(page->coordinates());
    last = last.cwiseMax(page->coordinates());
  }
  size_ = last - first_ + VoxelIndex::Ones();
  const auto x = static_cast<size_t>(size_.x());
  const auto y = static_cast<size_t>(size_.y());
  const size_t places = x * y * static_cast<size_t>(size_.z());
  if (places > std::max(kFewPlaces, kPlacesPerPage * pages.size())) {
    sorted_.reserve(pages.size());
    for (const std::shared_ptr<const BrickPage>& page : pages) sorted_.push_back(page.get());
    return;
  }
  table_.assign(places, nullptr);
  for (const std::shared_ptr<const BrickPage>& page : pages) {
    const VoxelIndex p = page->coordinates() - first_;
    table_[static_cast<size_t>(p.x()) +
           x * (static_cast<size_t>(p.y()) + y * static_cast<size_t>(p.z()))] = page.get();
  }
}

const BrickPage* PageTable::Search(const VoxelIndex& page) const {
  const BrickKey key = KeyOf(page);
  const auto it = std::partition_point(sorted_.begin(), sorted_.end(), [key](const BrickPage* at) {
    return KeyOf(at->coordinates()) < key;
  });
  return it != sorted_.end() && (*it)->coordinates() == page ? *it : nullptr;
}

}  // namespace vantage::model
