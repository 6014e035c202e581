// Neighbouring places in a list of cells.
#ifndef VANTAGE_CORE_PLANNING_PLAN_CELL_RANGE_H_
#define VANTAGE_CORE_PLANNING_PLAN_CELL_RANGE_H_

#include <cstddef>
#include <cstdint>
#include <iterator>

namespace vantage::planning {

// The numbers from `first` on, up to but without `limit`, like a container of them. Clang 14 does
// not compile std::ranges::iota_view, which is the same thing.
struct CellRange {
  uint32_t first = 0;
  uint32_t limit = 0;

  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = uint32_t;
    using difference_type = std::ptrdiff_t;
    using pointer = const uint32_t*;
    using reference = uint32_t;

    explicit Iterator(uint32_t at) : at_(at) {}
    uint32_t operator*() const { return at_; }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    Iterator operator++(int) { return Iterator(at_++); }
    bool operator==(const Iterator&) const = default;

   private:
    uint32_t at_;
  };

  Iterator begin() const { return Iterator(first); }
  Iterator end() const { return Iterator(limit); }
  size_t size() const { return limit - first; }
  bool empty() const { return first == limit; }
  uint32_t front() const { return first; }
  uint32_t back() const { return limit - 1; }
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_CELL_RANGE_H_
