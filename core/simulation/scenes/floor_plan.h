// Rooms, walls with doorways and windows, and where furniture may stand so that every room stays
// reachable.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_FLOOR_PLAN_H_
#define VANTAGE_CORE_SIMULATION_SCENES_FLOOR_PLAN_H_

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// An opening in a wall; lengths along the wall from its beginning, heights over the floor, m.
struct Opening {
  double middle = 0;
  double width = 0.95;
  double sill = 0;
  double head = 2.0;
  bool window = false;       // closed by a pane of glass; otherwise a doorway
  double leaf_angle = 0;     // rad, how far a door leaf stands open; 0: there is none
  bool leaf_at_end = false;  // hinged at the far jamb
  bool leaf_to_left = true;  // opens to the left of the wall's direction
};

// Runs along x or y.
struct Wall {
  Eigen::Vector2d from;
  Eigen::Vector2d to;
  double thickness = 0.12;
  std::vector<Opening> openings;
};

// A rectangle on the floor: where something stands.
struct Footprint {
  Eigen::Vector2d middle;
  Eigen::Vector2d half_size;
  double yaw = 0;  // rad

  double DistanceTo(const Eigen::Vector2d& point) const;  // m, 0 inside
  bool Overlaps(const Footprint& other) const;
};

// Something to place. Its own frame: origin on the floor in the middle of its back, x along the
// back, y to the front.
struct Item {
  double width = 1;   // along x, m
  double depth = 1;   // along y, m
  double height = 1;  // m
};

class FloorPlan {
 public:
  // `extent` is the outside of the outer walls. `passage` is the radius, m, for which all doorways
  // and rooms stay connected whatever is placed.
  FloorPlan(const Eigen::AlignedBox2d& extent, double height, double passage);

  void AddRoom(Room room) { rooms_.push_back(std::move(room)); }
  void AddWall(const Wall& wall);
  // Leaves a hole in the floor, or in the ceiling, for stairs. One each.
  void OpenFloor(const Eigen::AlignedBox2d& hole) { floor_hole_ = hole; }
  void OpenCeiling(const Eigen::AlignedBox2d& hole) { ceiling_hole_ = hole; }
  const std::vector<Room>& rooms() const { return rooms_; }
  double height() const { return height_; }
  std::vector<SceneDoorway> Doorways() const;

  // Floor, ceiling, walls, panes and door leaves.
  void Build(MeshBuilder& builder) const;

  // Finds a place with the item's back to a wall of the room, and takes it. Returns T_scene_item,
  // or nothing when there is no place that leaves everything reachable. Items higher than a
  // window's sill do not stand before it.
  std::optional<Eigen::Isometry3d> PlaceAtWall(const Room& room, const Item& item,
                                               RandomSequence& random);
  // Somewhere in the room, turned by `yaw`, or any way when there is none.
  std::optional<Eigen::Isometry3d> PlaceFreely(const Room& room, const Item& item,
                                               std::optional<double> yaw, RandomSequence& random);
  // Exactly there (a chair at a table), if it can be.
  bool PlaceThere(const Room& room, const Item& item, const Eigen::Isometry3d& T_scene_item);

  // The freest spot of a room: farthest from everything that stands in it, and its distance, m.
  struct Spot {
    Eigen::Vector2d at;
    double clearance;
  };
  std::optional<Spot> FreestSpot(const Room& room) const;

 private:
  Footprint FootprintOf(const Item& item, const Eigen::Isometry3d& T_scene_item) const;
  bool Fits(const Room& room, const Footprint& footprint, double height) const;
  // Whether, with the footprint blocked, the room's doorways are still connected through the room
  // and most of what is free in it is connected to them.
  bool LeavesReachable(const Room& room, const Footprint& footprint) const;
  void Block(const Footprint& footprint);
  bool TryTake(const Room& room, const Item& item, const Eigen::Isometry3d& T_scene_item);
  Eigen::Vector2d CellMiddle(int column, int row) const;
  template <typename Visit>
  void ForCellsNear(const Footprint& footprint, double distance, const Visit& visit) const;

  Eigen::AlignedBox2d extent_;
  double height_;
  double passage_;
  int columns_;
  int rows_;
  std::vector<uint8_t> blocked_;  // per cell of 5 cm: within `passage` of something
  std::vector<Room> rooms_;
  std::vector<Wall> walls_;
  Eigen::AlignedBox2d floor_hole_;    // empty: none
  Eigen::AlignedBox2d ceiling_hole_;  // empty: none
  std::vector<Footprint> solids_;     // walls and door leaves
  std::vector<Footprint> standing_;   // what was placed
  std::vector<Footprint> kept_free_;  // before doorways
  struct Sill {
    Footprint zone;
    double height;
  };
  std::vector<Sill> sills_;
  std::vector<Eigen::Vector2d> must_connect_;  // doorways
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_FLOOR_PLAN_H_
