// A room with windows, a mirror, a polished floor and a dark cupboard, or with none of them.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_PANE_ROOM_H_
#define VANTAGE_CORE_SIMULATION_SCENES_PANE_ROOM_H_

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// The parts of a pane room that deceive scanners.
struct Panes {
  bool windows = true;         // two, of glass
  bool mirror = true;          // from the floor up, 1.3 x 1.95 m, 3 cm before the wall
  bool polished_floor = true;  // Material::kPolished
  bool dark_cupboard = true;   // Material::kDark
};

// One furnished room of 5.2 x 4.2 x 2.6 m, with or without what deceives scanners: the triangles
// are always the same, only their materials differ.
Scene PaneRoom(const Panes& panes);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_PANE_ROOM_H_
