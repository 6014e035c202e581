// The ways by which a scanner is carried, and their lengths (algorithm.md section 11, 'Travel').
#ifndef VANTAGE_CORE_FLEET_TRAVEL_H_
#define VANTAGE_CORE_FLEET_TRAVEL_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/feasibility/floor_nodes.h"

namespace vantage::fleet {

// The floors over which a scanner's axis can be moved.
struct WalkGrid {
  planning::FloorNodes nodes;
  std::vector<uint8_t> passable;  // by node
};

// The grid on which reachability was decided; it accounts for the scanner's footprint. Floors
// outside `reach` (m, seen from above; empty: everywhere) are not passable.
WalkGrid WalkGridOf(const planning::FeasibleViews& feasible,
                    std::span<const Eigen::AlignedBox3d> reach);

// Shortest ways from one place to all others (Lazy Theta*). They run straight through passable
// columns and bend at centres of columns only, so their length, which is that seen from above, is
// right to about the width of a column at each corner. Ways along the grid's eight directions only
// would be up to 8 % longer. Stairs and ramps join the floors of different storeys.
class TravelMap {
 public:
  TravelMap() = default;
  // `from` counts as passable, since a scanner stands there. When the budget expires on the way,
  // places not reached yet count as unreachable.
  TravelMap(const WalkGrid& grid, const Eigen::Vector3d& from,
            const parallel::Budget& budget = parallel::Budget::Unlimited())
      : TravelMap(grid, from, std::nullopt, budget) {}
  // The same as far as the way to one place needs it: what is farther counts as unreachable.
  static TravelMap To(const WalkGrid& grid, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                      const parallel::Budget& budget = parallel::Budget::Unlimited()) {
    return {grid, from, to, budget};
  }

  // True when `from` lies on the grid.
  bool known() const { return !length_.empty(); }
  // Length of the way, m; absent when there is no way.
  std::optional<double> Length(const Eigen::Vector3d& to) const;
  // Corners of the way, m, at the floor's height, including both ends. Empty when there is no way.
  std::vector<Eigen::Vector3d> Way(const Eigen::Vector3d& to) const;

 private:
  TravelMap(const WalkGrid& grid, const Eigen::Vector3d& from,
            const std::optional<Eigen::Vector3d>& to, const parallel::Budget& budget);

  WalkGrid grid_;
  std::optional<uint32_t> start_;  // node
  std::vector<float> length_;      // m, by node; infinity: no way
  std::vector<uint32_t> parent_;   // by node: the previous corner of its way
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_TRAVEL_H_
