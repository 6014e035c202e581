// Walks over lists that keep their elements packed.
#ifndef VANTAGE_CORE_MODEL_VIEW_VALUE_ITERATOR_H_
#define VANTAGE_CORE_MODEL_VIEW_VALUE_ITERATOR_H_

#include <cstddef>
#include <iterator>

namespace vantage::model {

// Goes through a list whose operator[] unpacks an element and returns it by value: there is no
// element in memory to refer to. The list outlives it.
template <typename List, typename Value>
class ValueIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = Value;
  using difference_type = std::ptrdiff_t;
  using pointer = const Value*;
  using reference = Value;

  ValueIterator(const List& list, size_t at) : list_(&list), at_(at) {}
  Value operator*() const { return (*list_)[at_]; }
  ValueIterator& operator++() {
    ++at_;
    return *this;
  }
  ValueIterator operator++(int) {
    const ValueIterator before = *this;
    ++at_;
    return before;
  }
  bool operator==(const ValueIterator& other) const { return at_ == other.at_; }

 private:
  const List* list_;
  size_t at_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_VALUE_ITERATOR_H_
