// A flat to scan.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_FURNISHED_FLAT_H_
#define VANTAGE_CORE_SIMULATION_SCENES_FURNISHED_FLAT_H_

#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// A furnished flat of 5 or 6 rooms, about 12 x 9 x 2.7 m: hall, living room with kitchen, bedrooms,
// bath; doorways 0.95 x 2 m, some with open leaves, windows, mirrors, tables, chairs, shelves,
// beds, a sofa and clutter.
Scene FurnishedFlat(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_FURNISHED_FLAT_H_
