// Where the pages of a planning view are.
#ifndef VANTAGE_CORE_MODEL_VIEW_PAGE_TABLE_H_
#define VANTAGE_CORE_MODEL_VIEW_PAGE_TABLE_H_

#include <cstddef>
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
    const VoxelIndex p = page - first_;
    if ((p.array() < 0).any() || (p.array() >= size_.array()).any()) return nullptr;
    if (table_.empty()) return Search(page);
    return table_[static_cast<size_t>(p.x()) +
                  static_cast<size_t>(size_.x()) *
                      (static_cast<size_t>(p.y()) +
                       static_cast<size_t>(size_.y()) * static_cast<size_t>(p.z()))];
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
