// Disjoint sets of numbers (Tarjan 1975).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_GROUPS_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_GROUPS_H_

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace vantage::planning {

// Each group is named after its lowest number, whatever the order of joining.
class Groups {
 public:
  // Numbers below `count`, each by itself.
  explicit Groups(size_t count) : lowest_(count) {
    std::iota(lowest_.begin(), lowest_.end(), size_t{0});
  }

  size_t Add() {
    lowest_.push_back(lowest_.size());
    return lowest_.size() - 1;
  }
  size_t Of(size_t i) {
    while (lowest_[i] != i) {
      lowest_[i] = lowest_[lowest_[i]];
      i = lowest_[i];
    }
    return i;
  }
  void Join(size_t a, size_t b) {
    const size_t low = std::min(Of(a), Of(b));
    const size_t high = std::max(Of(a), Of(b));
    lowest_[high] = low;
  }

 private:
  std::vector<size_t> lowest_;  // of the same group, never higher
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_GROUPS_H_
