#include "core/model/view/brick_pages.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"

namespace vantage::model {

BrickPage::BrickPage(const BrickPage* before, std::span<const BrickAt* const> changes) {
  const std::span<const BrickAt> old =
      before == nullptr ? std::span<const BrickAt>() : std::span(before->bricks_);
  bricks_.reserve(old.size() + changes.size());
  const auto add = [this](const BrickAt& at) {
    if (at.contents != nullptr) bricks_.push_back(at);
  };
  size_t next = 0;
  for (const BrickAt* change : changes) {
    const int local = Brick::LocalOf(change->brick);
    while (next < old.size() && Brick::LocalOf(old[next].brick) < local) add(old[next++]);
    if (next < old.size() && Brick::LocalOf(old[next].brick) == local) ++next;
    add(*change);
  }
  while (next < old.size()) add(old[next++]);
  bricks_.shrink_to_fit();
  if (bricks_.empty()) return;
  first_ = last_ = bricks_.front().brick;
  for (const BrickAt& at : bricks_) {
    const int local = Brick::LocalOf(at.brick);
    held_.Set(local);
    at_[static_cast<size_t>(local)] = at.contents.get();
    surface_count_ += at.contents->surface.size();
    first_ = first_.cwiseMin(at.brick);
    last_ = last_.cwiseMax(at.brick);
  }
}

std::span<const BrickAt> BrickPage::Row(int y, int z) const {
  const int row = Brick::Local(0, y, z);
  const uint64_t word = held_.word[static_cast<size_t>(z)];
  const auto length = static_cast<size_t>(std::popcount(word >> (kSide * y) & 0xff));
  if (length == 0) return {};
  return std::span(bricks_).subspan(static_cast<size_t>(held_.Rank(row)), length);
}

BrickRange::Iterator::Iterator(std::span<const std::shared_ptr<const BrickPage>> pages)
    : pages_(pages) {
  if (pages_.empty()) return;
  layer_end_ = EndOfLayer(0);
  strip_end_ = EndOfStrip(0);
  row_ = pages_[0]->Row(0, 0);
  if (row_.empty()) NextRow();
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
  at_ = 0;
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
              row_ = {};
              return;
            }
            layer_end_ = EndOfLayer(layer_);
          }
          strip_ = layer_;
        }
        strip_end_ = EndOfStrip(strip_);
      }
      page_ = strip_;
    }
    row_ = pages_[page_]->Row(y_, z_);
  } while (row_.empty());
}

const BrickAt& BrickRange::operator[](size_t i) const {
  Iterator it = begin();
  for (; i >= it.row_.size(); it.NextRow()) i -= it.row_.size();
  return it.row_[i];
}

PageList WithChanges(const PageList& before, std::span<const BrickAt> changes, size_t& copied) {
  // The changes of each page, in the order given: that is by place in it.
  absl::flat_hash_map<BrickKey, std::vector<const BrickAt*>> by_page;
  BrickKey last_key = ~BrickKey{0};
  std::vector<const BrickAt*>* last = nullptr;
  std::vector<BrickKey> keys;
  for (const BrickAt& change : changes) {
    const BrickKey key = KeyOf(BrickPage::Of(change.brick));
    if (key != last_key) {
      const auto [it, fresh] = by_page.try_emplace(key);
      if (fresh) keys.push_back(key);
      last_key = key;
      last = &it->second;
    }
    last->push_back(&change);
  }
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
    auto page = std::make_shared<const BrickPage>(old, by_page.find(key)->second);
    ++copied;
    if (page->size() > 0) after.push_back(std::move(page));
  }
  while (next < before.size()) after.push_back(before[next++]);
  return after;
}

}  // namespace vantage::model
