// How far a scanner has to be carried (algorithm.md section 11, 'Travel').
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

namespace vantage::fleet {

// Where a scanner's axis can be: columns of a grid over the floor, each passable or not.
struct WalkGrid {
  Eigen::Vector2i first = Eigen::Vector2i::Zero();
  Eigen::Vector2i size = Eigen::Vector2i::Zero();
  double cell_size = 0;  // m; column c covers [c, c + 1) * cell_size
  std::vector<uint8_t> passable;
  std::vector<float> floor;  // m, z of the floor below

  bool Inside(const Eigen::Vector2i& c) const {
    return ((c - first).array() >= 0).all() && ((c - first).array() < size.array()).all();
  }
  size_t Index(const Eigen::Vector2i& c) const {
    return static_cast<size_t>(c.x() - first.x()) +
           static_cast<size_t>(size.x()) * static_cast<size_t>(c.y() - first.y());
  }
  Eigen::Vector2i ColumnOf(const Eigen::Vector3d& p) const {
    return (p.head<2>() / cell_size).array().floor().cast<int>();
  }
};

// The grid on which the feasible views' reachability was decided: the footprint is in it. Columns
// outside of `reach` (m, seen from above; none: everywhere) are not passable.
WalkGrid WalkGridOf(const planning::FeasibleViews& feasible,
                    std::span<const Eigen::AlignedBox3d> reach);

// Shortest ways from one place to all others. They bend at centres of columns only, and otherwise
// run straight through passable columns (Lazy Theta*), so that a way is as long as a taut rope
// around the corners to within the width of a column or so at each; ways along the grid's eight
// directions alone would be up to 8 % longer.
class TravelMap {
 public:
  TravelMap() = default;
  // `from` counts as passable: a scanner stands there. Where the budget expires on the way, places
  // not reached yet count as unreachable.
  TravelMap(const WalkGrid& grid, const Eigen::Vector3d& from,
            const parallel::Budget& budget = parallel::Budget::Unlimited());

  // `from` lies on the grid.
  bool known() const { return !length_.empty(); }
  // m; absent where there is no way.
  std::optional<double> Length(const Eigen::Vector3d& to) const;
  // Its corners, both ends included, m, at the floor's height. Empty where there is none.
  std::vector<Eigen::Vector3d> Way(const Eigen::Vector3d& to) const;

 private:
  WalkGrid grid_;
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero();
  std::vector<float> length_;     // m by column; infinity
  std::vector<uint32_t> parent_;  // the corner before
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_TRAVEL_H_
