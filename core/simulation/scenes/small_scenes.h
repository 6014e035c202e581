// Scenes of one or two rooms.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_SMALL_SCENES_H_
#define VANTAGE_CORE_SIMULATION_SCENES_SMALL_SCENES_H_

#include <Eigen/Core>
#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// Two sparsely furnished rooms joined by a doorway.
Scene TwoRooms(uint64_t seed);

// A hall of about 18 x 14 x 4.2 m with pillars and some crates.
Scene PillarHall(uint64_t seed);

// An empty box from the origin to `size` (m), whose ranges are known in closed form. The only start
// is its middle in plan, at 1.5 m or half its height if that is lower.
Scene BoxRoom(const Eigen::Vector3d& size);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_SMALL_SCENES_H_
