#include "core/model/merge/brick_set.h"

#include <algorithm>

namespace vantage::model {
namespace {

constexpr uint64_t kEach = 0x0101010101010101;  // a bit of every row along x

// A mask moved by one brick: what stays in the page, and what enters the page beyond.
struct Moved {
  BrickMask within;
  BrickMask beyond;
};

Moved Move(const BrickMask& mask, int axis, int direction) {
  Moved moved;
  constexpr size_t kLast = Brick::kSide - 1;
  if (axis == 2) {
    for (size_t z = 0; z < mask.word.size(); ++z) {
      if (direction > 0) {
        (z == kLast ? moved.beyond.word[0] : moved.within.word[z + 1]) = mask.word[z];
      } else {
        (z == 0 ? moved.beyond.word[kLast] : moved.within.word[z - 1]) = mask.word[z];
      }
    }
    return moved;
  }
  // Of a slice: bits to move by, and those that leave it.
  const int by = axis == 0 ? 1 : 8;
  const uint64_t upper = axis == 0 ? kEach << 7 : uint64_t{0xff} << 56;
  const uint64_t lower = axis == 0 ? kEach : uint64_t{0xff};
  for (size_t z = 0; z < mask.word.size(); ++z) {
    const uint64_t word = mask.word[z];
    if (direction > 0) {
      moved.within.word[z] = (word & ~upper) << by;
      moved.beyond.word[z] = (word & upper) >> (7 * by);
    } else {
      moved.within.word[z] = (word & ~lower) >> by;
      moved.beyond.word[z] = (word & lower) << (7 * by);
    }
  }
  return moved;
}

BrickKey PageBeside(BrickKey page, int axis, int direction) {
  VoxelIndex at = BrickOf(page);
  at[axis] += direction;
  return KeyOf(at);
}

}  // namespace

void BrickSet::Add(BrickKey page, const BrickMask& bricks) {
  if (!bricks.Any()) return;
  BrickMask& own = pages_[page];
  for (size_t w = 0; w < own.word.size(); ++w) own.word[w] |= bricks.word[w];
}

void BrickSet::Remove(BrickKey page, const BrickMask& bricks) {
  const auto it = pages_.find(page);
  if (it == pages_.end()) return;
  for (size_t w = 0; w < bricks.word.size(); ++w) it->second.word[w] &= ~bricks.word[w];
  if (!it->second.Any()) pages_.erase(it);
}

void BrickSet::Remove(const BrickSet& others) {
  for (const auto& [page, bricks] : others.pages_) Remove(page, bricks);
}

BrickMask BrickSet::In(BrickKey page) const {
  const auto it = pages_.find(page);
  return it == pages_.end() ? BrickMask() : it->second;
}

size_t BrickSet::size() const {
  size_t size = 0;
  for (const auto& [page, bricks] : pages_) size += static_cast<size_t>(bricks.Count());
  return size;
}

BrickSet BrickSet::GrownAlong(int axis) const {
  BrickSet grown = *this;
  for (const auto& [page, bricks] : pages_) {
    for (const int direction : {-1, 1}) {
      const Moved moved = Move(bricks, axis, direction);
      grown.Add(page, moved.within);
      grown.Add(PageBeside(page, axis, direction), moved.beyond);
    }
  }
  return grown;
}

BrickSet BrickSet::Grown() const { return GrownAlong(0).GrownAlong(1).GrownAlong(2); }

BrickMask BrickSet::EdgeIn(BrickKey page, int axis, int direction) const {
  // Moved back by one, the set says of each brick whether its neighbour is in it.
  BrickMask edge = In(page);
  const Moved own = Move(edge, axis, -direction);
  const Moved beside = Move(In(PageBeside(page, axis, direction)), axis, -direction);
  for (size_t w = 0; w < edge.word.size(); ++w) {
    edge.word[w] &= ~(own.within.word[w] | beside.beyond.word[w]);
  }
  return edge;
}

std::vector<BrickKey> BrickSet::Keys() const {
  std::vector<BrickKey> keys;
  keys.reserve(size());
  for (const auto& [page, bricks] : pages_) {
    const VoxelIndex first = BrickOf(page) * BrickPage::kSide;
    bricks.ForEach([&](int local) {
      keys.push_back(KeyOf(first + VoxelIndex(local & 7, local >> 3 & 7, local >> 6)));
    });
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace vantage::model
