// A door that has to stay open for a view to register (algorithm.md section 9, 'Doors that stay
// open').
#ifndef VANTAGE_CORE_PLANNING_PLAN_OPEN_DOOR_H_
#define VANTAGE_CORE_PLANNING_PLAN_OPEN_DOOR_H_

#include <Eigen/Core>

namespace vantage::planning {

struct OpenDoor {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, model frame: on the floor, between jambs
  double width = 0;                                  // m, clear
  double overlap_share = 0;  // of what the view registers by: what it sees through the door, [0, 1]
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_OPEN_DOOR_H_
