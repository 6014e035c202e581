// Where the pages of a planning view are.
#ifndef VANTAGE_CORE_MODEL_VIEW_PAGE_TABLE_H_
#define VANTAGE_CORE_MODEL_VIEW_PAGE_TABLE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/model/view/brick_pages.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// Finds pages by their coordinates: in a table over the box that they span, which takes 8 bytes a
// place (a place is a cube of 64 voxels), or by search where they are few for that box.
class PageTable {
 public:
  PageTable() = default;  // of no pages
  // In order of their coordinates, by z, y, x. They outlive this.
  explicit PageTable(std::span<const std::shared_ptr<const BrickPage>> pages);

  // Null where there is none.
  const BrickPage* Find(const VoxelIndex& page) const {
    // What is below the first is a large number.
    const auto x = static_cast<uint32_t>(page.x() - first_.x());
    const auto y = static_cast<uint32_t>(page.y() - first_.y());
    const auto z = static_cast<uint32_t>(page.z() - first_.z());
    const auto nx = static_cast<uint32_t>(size_.x());
    const auto ny = static_cast<uint32_t>(size_.y());
    if (x >= nx || y >= ny || z >= static_cast<uint32_t>(size_.z())) return nullptr;
    if (table_.empty()) return Search(page);
    return table_[x + size_t{nx} * (y + size_t{ny} * z)];
  }

 private:
  const BrickPage* Search(const VoxelIndex& page) const;

  VoxelIndex first_ = VoxelIndex::Zero();
  VoxelIndex size_ = VoxelIndex::Zero();
  std::vector<const BrickPage*> table_;   // null: no page there
  std::vector<const BrickPage*> sorted_;  // instead, by z, y, x
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_PAGE_TABLE_H_
