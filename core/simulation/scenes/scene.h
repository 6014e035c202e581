// A scene that the project generates, by seed.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_SCENE_H_
#define VANTAGE_CORE_SIMULATION_SCENES_SCENE_H_

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

// The inside of a room: what lies between its walls, m.
struct Room {
  std::string name;
  Eigen::AlignedBox2d inside;
};

// A doorway as it was built.
struct SceneDoorway {
  Eigen::Vector2d middle;  // m
  Eigen::Vector2d along;   // unit, from jamb to jamb
  double width = 0;        // m, between the jambs; a leaf that stands open may leave less
  double head = 0;         // m over the floor
};

// All generated scenes: the first floor at z = 0, closed but for panes of glass with nothing behind
// them, and every room reachable for a scanner 0.7 m wide. The same seed gives the same scene on
// every machine.
struct Scene {
  std::string name;
  TriangleMesh mesh;
  double floor_height = 0;              // m, below the first start
  bool several_levels = false;          // there is other ground than at that height
  std::vector<Eigen::Vector3d> starts;  // m, free places for a first scan, viewpoint height
  std::vector<SceneDoorway> doorways;   // of scenes with a floor plan
  std::vector<Room> rooms;              // that they lead to, corridors among them
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_SCENE_H_
