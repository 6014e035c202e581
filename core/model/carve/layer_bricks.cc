#include "core/model/carve/layer_bricks.h"

#include <utility>

namespace vantage::model {
namespace {

BrickKey PageKeyOf(const VoxelIndex& brick) { return KeyOf(BrickPage::Of(brick)); }

}  // namespace

const LayerBrick& LayerBricks::AllEmpty() {
  static const LayerBrick* const brick = [] {
    auto* all = new LayerBrick();
    all->empty.word.fill(~uint64_t{0});
    return all;
  }();
  return *brick;
}

bool LayerBricks::IsEmpty(BrickKey brick) const {
  if (empty_.empty()) return false;
  const VoxelIndex at = BrickOf(brick);
  const auto it = empty_.find(PageKeyOf(at));
  return it != empty_.end() && it->second.Has(Brick::LocalOf(at));
}

bool LayerBricks::TakeEmpty(BrickKey brick) {
  const VoxelIndex at = BrickOf(brick);
  const auto it = empty_.find(PageKeyOf(at));
  if (it == empty_.end() || !it->second.Has(Brick::LocalOf(at))) return false;
  it->second.Clear(Brick::LocalOf(at));
  if (!it->second.Any()) empty_.erase(it);
  return true;
}

const LayerBrick* LayerBricks::Find(BrickKey brick) const {
  const auto it = own_.find(brick);
  if (it != own_.end()) return &it->second;
  return IsEmpty(brick) ? &AllEmpty() : nullptr;
}

LayerBrick& LayerBricks::operator[](BrickKey brick) {
  const auto [it, fresh] = own_.try_emplace(brick);
  if (fresh && TakeEmpty(brick)) it->second = AllEmpty();
  return it->second;
}

void LayerBricks::Put(BrickKey brick, LayerBrick contents) {
  if (!contents.WhollyEmpty()) {
    (void)TakeEmpty(brick);
    own_.insert_or_assign(brick, std::move(contents));
    return;
  }
  own_.erase(brick);
  const VoxelIndex at = BrickOf(brick);
  empty_[PageKeyOf(at)].Set(Brick::LocalOf(at));
}

LayerBrick LayerBricks::Take(BrickKey brick) {
  if (TakeEmpty(brick)) return AllEmpty();
  const auto it = own_.find(brick);
  if (it == own_.end()) return {};
  LayerBrick taken = std::move(it->second);
  own_.erase(it);
  return taken;
}

void LayerBricks::PutEmpty(const VoxelIndex& page, const BrickMask& bricks) {
  if (!bricks.Any()) return;
  BrickMask& all = empty_[KeyOf(page)];
  for (size_t w = 0; w < all.word.size(); ++w) all.word[w] |= bricks.word[w];
}

void LayerBricks::clear() {
  own_.clear();
  empty_.clear();
}

size_t LayerBricks::bytes() const {
  constexpr size_t kHeap = 16;  // that the allocator adds to each piece
  size_t bytes = own_.capacity() * (sizeof(std::pair<BrickKey, LayerBrick>) + 1) +
                 empty_.capacity() * (sizeof(std::pair<BrickKey, BrickMask>) + 1);
  for (const auto& [key, brick] : own_) {
    if (!brick.sums.empty()) bytes += brick.sums.bytes() + kHeap;
  }
  return bytes;
}

size_t LayerBricks::size() const {
  size_t size = own_.size();
  for (const auto& [page, bricks] : empty_) size += static_cast<size_t>(bricks.Count());
  return size;
}

}  // namespace vantage::model
