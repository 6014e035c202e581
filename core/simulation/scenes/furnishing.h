// Which furniture goes into which kind of room.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_FURNISHING_H_
#define VANTAGE_CORE_SIMULATION_SCENES_FURNISHING_H_

#include "core/simulation/scenes/floor_plan.h"
#include "core/simulation/scenes/furniture.h"

namespace vantage::simulation {

// Furnishes rooms of one plan, in the order of the calls.
class Furnishing {
 public:
  using AddFunction = void (*)(const Item&, RandomSequence&, MeshBuilder&);

  Furnishing(FloorPlan& plan, RandomSequence& random, MeshBuilder& builder)
      : plan_(plan), random_(random), builder_(builder) {}

  // Each returns whether a place was found.
  bool AtWall(const Room& room, const Item& item, AddFunction add);
  bool Freely(const Room& room, const Item& item, AddFunction add);
  // A table with chairs on both long sides, anywhere.
  bool TableWithChairs(const Room& room, const Item& table, int chairs);
  // A desk at a wall with a chair before it.
  bool DeskWithChair(const Room& room);
  void CeilingLamps(const Room& room, double spacing);

  void Living(const Room& room);
  void Bedroom(const Room& room);
  void ChildsRoom(const Room& room);
  void Study(const Room& room);
  void Bath(const Room& room);
  void Hall(const Room& room);
  void Office(const Room& room);
  void MeetingRoom(const Room& room);
  void Corridor(const Room& room);

 private:
  void Chair(const Room& room, const Eigen::Isometry3d& T_scene_table, double x, double depth,
             bool in_front);

  FloorPlan& plan_;
  RandomSequence& random_;
  MeshBuilder& builder_;
};

// A doorway's opening whose leaf (if any) stands open into the side of the wall where `into` lies.
Opening Doorway(const Wall& wall, double middle, const Eigen::Vector2d& into,
                RandomSequence& random);
Opening Window(double middle, double width, double sill, double head);

// One start per room, where it is freest, at viewpoint height; rooms with less than half a metre
// around that are left out.
std::vector<Eigen::Vector3d> StartsIn(const FloorPlan& plan);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_FURNISHING_H_
