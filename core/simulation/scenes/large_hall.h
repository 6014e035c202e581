// A hall so large that most of what a scan says of it is empty space.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_LARGE_HALL_H_
#define VANTAGE_CORE_SIMULATION_SCENES_LARGE_HALL_H_

#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// 100 x 60 x 15 m: columns in rows, shelves and crates, and along one side three rooms behind gates
// and a door. The first start is the middle of the hall.
Scene LargeHall(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_LARGE_HALL_H_
