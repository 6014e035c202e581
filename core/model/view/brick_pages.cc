#include "core/model/view/brick_pages.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"

namespace vantage::model {

namespace {

BrickMask OpaqueVoxels(const Brick& brick) {
  // Eight states at a time: a byte that is no different from kEmpty does not carry into its highest
  // bit, since there are fewer than 128 states. The product gathers those bits.
  static_assert(kVoxelStates < 128 && std::endian::native == std::endian::little);
  constexpr uint64_t kEach = 0x0101010101010101;
  BrickMask opaque;
  for (size_t row = 0; row < Brick::kVoxels / 8; ++row) {
    uint64_t states = 0;
    std::memcpy(&states, brick.state.data() + 8 * row, 8);
    states ^= kEach * static_cast<uint64_t>(VoxelState::kEmpty);
    const uint64_t differs = (states + 0x7f * kEach) >> 7 & kEach;
    opaque.word[row / 8] |= (differs * 0x0102040810204080) >> 56 << (8 * (row % 8));
  }
  return opaque;
}

}  // namespace

size_t EmptiedBricks::size() const {
  size_t size = 0;
  for (const auto& [page, bricks] : by_page) size += static_cast<size_t>(bricks.Count());
  return size;
}

BrickPage::BrickPage(const BrickPage* before, const VoxelIndex& at,
                     std::span<const BrickAt* const> changes, const BrickMask& emptied,
                     const std::shared_ptr<const Brick>& empty) {
  const std::shared_ptr<const Brick> unknown;
  std::array<const std::shared_ptr<const Brick>*, Brick::kVoxels> contents;
  contents.fill(&unknown);
  std::array<uint16_t, Brick::kVoxels> old_slot{};  // 0: none, or changed
  if (before != nullptr) {
    old_slot = before->slot_;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      contents[static_cast<size_t>(local)] = &before->Contents(local);
    }
  }
  for (const BrickAt* change : changes) {
    const auto local = static_cast<size_t>(Brick::LocalOf(change->brick));
    contents[local] = &change->contents;
    old_slot[local] = kUnknown;
  }
  emptied.ForEach([&](int local) {
    contents[static_cast<size_t>(local)] = &empty;
    old_slot[static_cast<size_t>(local)] = kEmpty;  // no need to look
  });
  const VoxelIndex origin = at * kSide;
  size_t mixed = 0;
  std::vector<std::pair<uint16_t, BrickMask>> changed;  // place in the page, of changed bricks
  changed.reserve(changes.size());
  for (size_t local = 0; local < contents.size(); ++local) {
    const Brick* brick = contents[local]->get();
    if (brick == nullptr) continue;
    if (old_slot[local] == kUnknown) {
      changed.emplace_back(static_cast<uint16_t>(local), OpaqueVoxels(*brick));
      mixed += changed.back().second.Any() ? 1 : 0;
    } else {
      mixed += old_slot[local] != kEmpty ? 1 : 0;
    }
  }
  BrickMask all;
  all.word.fill(~uint64_t{0});
  bricks_.reserve(kFirst + mixed);
  opaque_.reserve(kFirst + mixed);
  bricks_.assign(kFirst, nullptr);
  opaque_ = {all, BrickMask()};
  size_t next = 0;
  bool any = false;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const auto i = static_cast<size_t>(local);
    const std::shared_ptr<const Brick>& brick = *contents[i];
    if (brick == nullptr) {
      with_opaque_.Set(local);
      continue;
    }
    const BrickMask& opaque = old_slot[i] == kUnknown ? changed[next++].second
                              : old_slot[i] == kEmpty ? opaque_[kEmpty]
                                                      : before->opaque_[old_slot[i]];
    if (opaque.Any()) {
      slot_[i] = static_cast<uint16_t>(bricks_.size());
      bricks_.push_back(brick);
      opaque_.push_back(opaque);
      with_opaque_.Set(local);
      if (!opaque.All()) with_empty_.Set(local);
    } else {
      slot_[i] = kEmpty;
      if (bricks_[kEmpty] == nullptr) bricks_[kEmpty] = brick;
      with_empty_.Set(local);
    }
    held_.Set(local);
    ++size_;
    surface_count_ += brick->surface.size();
    const VoxelIndex where = origin + VoxelIndex(local & 7, local >> 3 & 7, local >> 6);
    first_ = any ? first_.cwiseMin(where) : where;
    last_ = any ? last_.cwiseMax(where) : where;
    any = true;
  }
  all_empty_ = !with_opaque_.Any();
  all_opaque_ = !with_empty_.Any();
}

BrickRange::Iterator::Iterator(std::span<const std::shared_ptr<const BrickPage>> pages, Of of)
    : pages_(pages), of_(of) {
  if (pages_.empty()) return;
  layer_end_ = EndOfLayer(0);
  strip_end_ = EndOfStrip(0);
  left_ = InRow();
  if (left_ == 0) {
    NextRow();
  } else {
    Load();
  }
}

uint32_t BrickRange::Iterator::InRow() const {
  const BrickPage& page = *pages_[page_];
  return of_ == Of::kKnown ? page.HeldInRow(y_, z_) : page.PartlyKnownInRow(y_, z_);
}

void BrickRange::Iterator::Load() {
  const BrickPage& page = *pages_[page_];
  const int x = std::countr_zero(left_);
  at_.brick = page.coordinates() * BrickPage::kSide + VoxelIndex(x, y_, z_);
  const std::shared_ptr<const Brick>& contents = page.Contents(Brick::Local(x, y_, z_));
  // Most often it is the same empty brick as before.
  if (at_.contents != contents) at_.contents = contents;
}

size_t BrickRange::Iterator::EndOfLayer(size_t first) const {
  const int z = pages_[first]->coordinates().z();
  size_t end = first + 1;
  while (end < pages_.size() && pages_[end]->coordinates().z() == z) ++end;
  return end;
}

size_t BrickRange::Iterator::EndOfStrip(size_t first) const {
  const int y = pages_[first]->coordinates().y();
  size_t end = first + 1;
  while (end < layer_end_ && pages_[end]->coordinates().y() == y) ++end;
  return end;
}

void BrickRange::Iterator::NextRow() {
  do {
    if (++page_ == strip_end_) {
      if (++y_ == BrickPage::kSide) {
        y_ = 0;
        strip_ = strip_end_;
        if (strip_ == layer_end_) {
          if (++z_ == BrickPage::kSide) {
            z_ = 0;
            layer_ = layer_end_;
            if (layer_ == pages_.size()) {
              return;  // nothing is left
            }
            layer_end_ = EndOfLayer(layer_);
          }
          strip_ = layer_;
        }
        strip_end_ = EndOfStrip(strip_);
      }
      page_ = strip_;
    }
    left_ = InRow();
  } while (left_ == 0);
  Load();
}

BrickAt BrickRange::operator[](size_t i) const {
  Iterator it = begin();
  for (size_t row = 0; i >= (row = static_cast<size_t>(std::popcount(it.left_))); i -= row) {
    it.NextRow();
  }
  for (; i > 0; --i) ++it;
  return *it;
}

PageList WithChanges(const PageList& before, std::span<const BrickAt> changes,
                     const EmptiedBricks& emptied, size_t& copied) {
  // The changes of each page, in the order given: that is by place in it.
  absl::flat_hash_map<BrickKey, std::vector<const BrickAt*>> by_page;
  BrickKey last_key = ~BrickKey{0};
  std::vector<const BrickAt*>* last = nullptr;
  for (const BrickAt& change : changes) {
    const BrickKey key = KeyOf(BrickPage::Of(change.brick));
    if (key != last_key) {
      last_key = key;
      last = &by_page[key];
    }
    last->push_back(&change);
  }
  for (const auto& [key, bricks] : emptied.by_page) by_page.try_emplace(key);
  std::vector<BrickKey> keys;
  keys.reserve(by_page.size());
  for (const auto& [key, page_changes] : by_page) keys.push_back(key);
  std::sort(keys.begin(), keys.end());

  PageList after;
  after.reserve(before.size() + keys.size());
  size_t next = 0;
  copied = 0;
  const auto key_of = [](const std::shared_ptr<const BrickPage>& page) {
    return KeyOf(page->coordinates());
  };
  for (const BrickKey key : keys) {
    while (next < before.size() && key_of(before[next]) < key) after.push_back(before[next++]);
    const BrickPage* old = nullptr;
    if (next < before.size() && key_of(before[next]) == key) old = before[next++].get();
    const auto empty = emptied.by_page.find(key);
    auto page = std::make_shared<const BrickPage>(
        old, BrickOf(key), by_page.find(key)->second,
        empty == emptied.by_page.end() ? BrickMask() : empty->second, emptied.contents);
    ++copied;
    if (page->size() > 0) after.push_back(std::move(page));
  }
  while (next < before.size()) after.push_back(before[next++]);
  return after;
}

}  // namespace vantage::model
