// Scenes under the open sky.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_OUTDOOR_SCENES_H_
#define VANTAGE_CORE_SIMULATION_SCENES_OUTDOOR_SCENES_H_

#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// Unlike other scenes they are open above and, but for the courtyard, to the sides: the ground ends
// somewhere and nothing is below it. Houses are solid; behind their panes is a wall that no scan
// sees.

// A house with a pitched roof, eaves, windows, a door and a balcony at one side of a square on
// which a van and a kiosk stand.
Scene FacadeScene(uint64_t seed);

// A yard of about 14 x 12 m with a well, within four wings under flat roofs, with a gateway that
// is shut.
Scene CourtyardScene(uint64_t seed);

// Two houses on either side of a street of about 10 m, one with a parapet and one with a pitched
// roof, lamp posts and cars.
Scene StreetScene(uint64_t seed);

// Ground that rises by about a seventh and rolls, with a hut, boulders and a retaining wall.
// `floor_height` is that of the ground at the first start.
Scene SlopeScene(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_OUTDOOR_SCENES_H_
