// Where a floor is known to be open, and where that was only assumed (algorithm.md section 7A, 'The
// floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_RAISED_STATIONS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_RAISED_STATIONS_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/planning/feasibility/floor_columns.h"

namespace vantage::planning {

// m, of a viewpoint over the floor that its tripod stands on.
inline constexpr double kHighestTripod = 2.2;
// Radius of the blind cone below a scanner in heights over the floor: of those that see down to 55
// degrees.
inline constexpr double kBlindCone = 0.7;
inline constexpr double kRoughness = 0.1;  // m, what one floor's roughness and noise take up

// The layer of voxels in which a floor lies. Below the next one down, nothing of it can lie,
// however it falls on the grid.
int LayerOf(float height, double voxel);

// True when the model shows that a column has no floor at this height: it is empty further down.
bool OpenBelow(const model::PlanningView& model, const Eigen::Vector2i& at, float height);

// Stations that stand higher than their own scan told: on stairs, where the steps around lie in the
// blind cone and most of what is seen is the hall at their foot. What is empty between the floor
// that was taken for theirs and the step under the tripod, which other scans measured, was only
// assumed (ClearStation()).
class RaisedStations {
 public:
  RaisedStations(const model::PlanningView& model, const FloorColumns& floor);

  bool Has(const model::Station& station) const;
  // True where that a column is empty below `height` says nothing.
  bool Assumed(const Eigen::Vector2i& at, float height) const;

 private:
  struct Raised {
    model::Station station;
    double floor;  // m, z: that it stands on
  };
  double voxel_;  // m
  std::vector<Raised> raised_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_RAISED_STATIONS_H_
