// Where one room leads on into another (algorithm.md section 7D).
#ifndef VANTAGE_CORE_PLANNING_PLAN_OPENING_H_
#define VANTAGE_CORE_PLANNING_PLAN_OPENING_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace vantage::planning {

// m over the floor: heads of doors are lower. Under a beam that is higher a room may go on.
inline constexpr double kHighestDoor = 2.5;

// Space at the height of a head, connected without going through an opening: a room, or as much of
// one as was seen from its door.
struct Space {
  int storey = 0;            // 0 is the lowest that is known
  bool entered = false;      // a scanner has stood in it
  double free_area = 0;      // m^2 in plan that are known to be empty
  double frontier_area = 0;  // m^2 of false surface around it that is not given up
};

// A gap between two pieces of wall that known-empty space leads through: a doorway, a passage, a
// window that stands open.
struct Opening {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, model frame: on the floor, between jambs
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit, horizontal: out of `from`
  double width = 0;                                      // m, clear, from jamb to jamb
  double head = 0;             // m over the floor, of the lintel or the ceiling
  double sill = 0;             // m over the floor, of what stands in it; 0 for nothing
  bool floor_through = false;  // floor is known in it or right behind it, and no sill is in the way
  bool lintel = false;         // wall goes on over it: it divides rooms, and not parts of one
  bool glimpsed = false;       // seen along its wall: next to nothing is known behind it
  int storey = 0;
  Eigen::Vector3d standing = Eigen::Vector3d::Zero();  // m, on the floor: a place before it
  int from = 0;    // into Openings::spaces: the side that is known better
  int behind = 0;  // into Openings::spaces: what it leads to

  // Somebody can walk through, as far as is known: no window, no hatch.
  bool doorway() const { return floor_through; }
  double height() const { return head - sill; }  // m, clear
};

// Openings and the spaces that they divide the known-empty space into, in the order of storeys, and
// then of rows.
struct Openings {
  std::vector<Space> spaces;
  std::vector<Opening> openings;

  const Space& Behind(const Opening& opening) const {
    return spaces[static_cast<size_t>(opening.behind)];
  }
  // True where an opening leads into a space that no scanner has stood in and that goes on into the
  // unknown.
  bool LeadsToUnknown(const Opening& opening) const;
  // The number of rooms that doorways with a lintel no higher than that of a door lead into and
  // that no scanner has stood in, at least: space that is known to hang together behind several
  // doorways counts once, and doorways that were only glimpsed may all lead into the same room.
  int RoomsNotEntered() const;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_OPENING_H_
