// Bounds of the sensing constraints between a box of views and a group of patch cells (algorithm.md
// section 8, 'Bounds').
#ifndef VANTAGE_CORE_PLANNING_SCORING_INTERVAL_CONSTRAINTS_H_
#define VANTAGE_CORE_PLANNING_SCORING_INTERVAL_CONSTRAINTS_H_

#include <Eigen/Geometry>
#include <cstdint>

#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

// Bounds over all cells of a group. Of values that are floats they are floats: exact, and half as
// large.
struct CellBounds {
  Eigen::AlignedBox3f position;  // m, model frame
  Eigen::AlignedBox3f normal;    // of the unit normals' components
  // Of n . (p - position's centre), m. A planar group is thin along its normals in any orientation.
  double offset_min = 0;
  double offset_max = 0;
  float least_density = 0;    // q, samples / m^2
  float most_enough = 0;      // samples / m^2
  bool has_dropouts = false;  // of some cells: their gain depends on the direction
  bool under_sky = false;     // the same: some of their rays pass into the sky

  static CellBounds Of(const CellArrays& cells, size_t begin, size_t end);
};

struct Interval {
  double min = 0;
  double max = 0;
};

struct PairBounds {
  Interval range;          // m
  Interval facing;         // n . (v - p), m
  Interval cos_incidence;  // facing / range
  Interval sin_elevation;  // of the direction from the view to the cell
  Interval density;        // s, samples / m^2; only where facing and range can be allowed
};

// Constraints that every view and cell of a pair satisfies. They hold for its parts, too, and are
// not tested again there.
enum : uint8_t {
  kRangeSatisfied = 1,
  kElevationSatisfied = 2,
  kIncidenceSatisfied = 4,
  kSensingSatisfied = 7,
  kVisible = 8,
};

class IntervalConstraints {
 public:
  explicit IntervalConstraints(const SensingConstraints& constraints);

  // All bounds, for any box (m).
  PairBounds Bound(const Eigen::AlignedBox3d& views, const CellBounds& cells) const;

  // Returns false when the pair gains nothing: some constraint is violated everywhere, or no view
  // gives a cell more than the density it has. Otherwise adds to `satisfied`, and `density` bounds
  // s where the constraints hold. The limits have a slack of 1e-6, since scores are computed in
  // floats.
  bool Test(const Eigen::AlignedBox3d& views, const CellBounds& cells, uint8_t& satisfied,
            Interval& density) const;

  // The least rho (samples per steradian) in the directions of the pair.
  double LeastPerSteradian(const Eigen::AlignedBox3d& views, const CellBounds& cells) const;

 private:
  struct Geometry;
  Interval Facing(const Eigen::AlignedBox3d& views, const Eigen::AlignedBox3d& position,
                  const CellBounds& cells) const;
  Interval PerSteradian(const Geometry& geometry) const;
  Interval Density(const Geometry& geometry, const Interval& facing) const;

  double per_steradian_;
  double least_cos_;
  double range_min_, range_max_;
  double sin_min_, sin_max_;
  double cos_incidence_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_INTERVAL_CONSTRAINTS_H_
