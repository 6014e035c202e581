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

// A furnished flat of several rooms with doorways, windows, a mirror, tables, chairs, shelves,
// beds, a sofa and clutter. The same seed gives the same flat on every machine.
Scene FurnishedFlat(uint64_t seed);

}  // namespace vantage

#endif  // VANTAGE_CORE_SIMULATION_SCENE_H_
