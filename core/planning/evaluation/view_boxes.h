// Boxes of views that lie close together, and so see mostly the same (algorithm.md section 8,
// 'Visibility of a shaft').
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_VIEW_BOXES_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_VIEW_BOXES_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/scoring/brute_force.h"

namespace vantage::planning {

// A lattice of boxes of about 0.6 m. References are kept.
class ViewBoxes {
 public:
  using Key = std::array<int, 3>;

  ViewBoxes(const BruteForceScorer& scorer, const FeasibleViews& views);

  // The box that the view lies in.
  Key KeyOf(uint32_t view) const;
  // All that its views are scored from, scene coordinates: their centres, what stands for them by
  // the scorer's sensitivity to poses, and the rounding of rays.
  Eigen::AlignedBox3d BoxOf(const Key& key) const;

 private:
  const BruteForceScorer& scorer_;
  const FeasibleViews& views_;
  const int side_;  // viewcells
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_BOXES_H_
