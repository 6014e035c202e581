// A house of several storeys, joined by stairs.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_HOUSE_H_
#define VANTAGE_CORE_SIMULATION_SCENES_HOUSE_H_

#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// A lowest storey, an upper storey and an attic under a gable roof. On the two lower storeys a hall
// leads from the street door (shut) past four furnished rooms to stairs of two flights with a
// landing; the attic is one room with a chimney and posts. The first start is in the hall of the
// lowest storey.
Scene HouseOfThreeStoreys(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_HOUSE_H_
