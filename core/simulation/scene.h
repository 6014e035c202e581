// Scenes that the project generates, by seed.
#ifndef VANTAGE_CORE_SIMULATION_SCENE_H_
#define VANTAGE_CORE_SIMULATION_SCENE_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/simulation/triangle_mesh.h"

namespace vantage {

struct Scene {
  std::string name;
  TriangleMesh mesh;
  double floor_height = 0;              // m
  std::vector<Eigen::Vector3d> starts;  // m, free places for a first scan, viewpoint height
};

// All generated scenes: floor at z = 0, closed but for panes of glass with nothing behind them, and
// every room reachable for a scanner 0.7 m wide. The same seed gives the same scene on every
// machine.

// A furnished flat of 5 or 6 rooms, about 12 x 9 x 2.7 m: hall, living room with kitchen, bedrooms,
// bath; doorways 0.95 x 2 m, some with open leaves, windows, mirrors, tables, chairs, shelves,
// beds, a sofa and clutter.
Scene FurnishedFlat(uint64_t seed);

// An office floor: corridors with rooms on both sides, `area_m2` in all (100 to 5,000).
Scene OfficeFloor(uint64_t seed, double area_m2);

// Two sparsely furnished rooms joined by a doorway.
Scene TwoRooms(uint64_t seed);

// A hall of about 18 x 14 x 4.2 m with pillars and some crates.
Scene PillarHall(uint64_t seed);

// An empty box from the origin to `size` (m), whose ranges are known in closed form. The only start
// is its middle in plan, at 1.5 m or half its height if that is lower.
Scene BoxRoom(const Eigen::Vector3d& size);

// What of a pane room is not as plain as a wall.
struct Panes {
  bool windows = true;         // two, of glass
  bool mirror = true;          // from the floor up, 1.3 x 1.95 m, 3 cm before the wall
  bool polished_floor = true;  // Material::kPolished
  bool dark_cupboard = true;   // Material::kDark
};

// One furnished room of 5.2 x 4.2 x 2.6 m to be scanned with and without what deceives scanners:
// the triangles are the same whatever the panes, only their materials differ.
Scene PaneRoom(const Panes& panes);

}  // namespace vantage

#endif  // VANTAGE_CORE_SIMULATION_SCENE_H_
