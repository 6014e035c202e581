// The levels of a building (algorithm.md section 7A, 'Storeys').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/planning/feasibility/floor_columns.h"
#include "core/planning/plan/storey.h"

namespace vantage::planning {

// Storeys by height, from the lowest up. There always is one at least.
class Storeys {
 public:
  // One, of which no level floor is known.
  Storeys() = default;
  // One whose floor is at `floor_z`, m.
  explicit Storeys(double floor_z) : heights_{floor_z} {}
  // `voxel` in m.
  static Storeys Of(const FloorColumns& floor, double voxel);

  size_t count() const { return std::max<size_t>(1, heights_.size()); }
  // z of the level floor of a storey, m; nothing where none is known.
  std::optional<double> Height(size_t storey) const {
    return storey < heights_.size() ? std::optional(heights_[storey]) : std::nullopt;
  }
  // The storey that floor at z (m) belongs to, 0 the lowest.
  int At(double z) const;
  // What people are told, with the names that they gave: of one of them, and of all.
  Storey Describe(int storey, std::span<const NamedStorey> named) const;
  std::vector<Storey> DescribeAll(std::span<const NamedStorey> named) const;

 private:
  std::vector<double> heights_;  // ascending
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_
