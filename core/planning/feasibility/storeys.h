// The levels of a building (algorithm.md section 7A, 'Storeys').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_

#include <vector>

#include "core/planning/feasibility/floor_columns.h"

namespace vantage::planning {

// Storeys by height, from the lowest up. There always is one at least.
class Storeys {
 public:
  Storeys() : heights_{0} {}
  // `voxel` in m.
  static Storeys Of(const FloorColumns& floor, double voxel);

  size_t count() const { return heights_.size(); }
  // z of the level floor of a storey, m.
  double Height(size_t storey) const { return heights_[storey]; }
  // The storey that floor at z (m) belongs to, 0 the lowest.
  int At(double z) const;

 private:
  std::vector<double> heights_;  // ascending
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_STOREYS_H_
