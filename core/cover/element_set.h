// Sets of elements of surface, as bits.
#ifndef VANTAGE_CORE_COVER_ELEMENT_SET_H_
#define VANTAGE_CORE_COVER_ELEMENT_SET_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vantage::cover {

// Bit i % 64 of word i / 64 stands for element i.
using ElementSet = std::vector<uint64_t>;

inline ElementSet EmptySet(size_t elements) { return ElementSet((elements + 63) / 64, 0); }
inline bool Contains(const ElementSet& set, size_t element) {
  return (set[element / 64] >> (element % 64) & 1) != 0;
}
inline void Insert(ElementSet& set, size_t element) {
  set[element / 64] |= uint64_t{1} << (element % 64);
}
// Both are of the same elements.
inline void Unite(ElementSet& set, const ElementSet& other) {
  for (size_t word = 0; word < set.size(); ++word) set[word] |= other[word];
}
inline void Subtract(ElementSet& set, const ElementSet& other) {
  for (size_t word = 0; word < set.size(); ++word) set[word] &= ~other[word];
}

// Calls fn(element) for each element of a set, ascending.
template <typename Fn>
void ForEach(const ElementSet& set, Fn fn) {
  for (size_t word = 0; word < set.size(); ++word) {
    for (uint64_t bits = set[word]; bits != 0; bits &= bits - 1) {
      fn(64 * word + static_cast<size_t>(std::countr_zero(bits)));
    }
  }
}
// The same of those that are in `set` and not in `without`.
template <typename Fn>
void ForEachBeyond(const ElementSet& set, const ElementSet& without, Fn fn) {
  for (size_t word = 0; word < set.size(); ++word) {
    for (uint64_t bits = set[word] & ~without[word]; bits != 0; bits &= bits - 1) {
      fn(64 * word + static_cast<size_t>(std::countr_zero(bits)));
    }
  }
}

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_ELEMENT_SET_H_
