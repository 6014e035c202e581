// Scenes with edges, stairs and floors over one another.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_EDGE_SCENES_H_
#define VANTAGE_CORE_SIMULATION_SCENES_EDGE_SCENES_H_

#include <cstdint>
#include <vector>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// Unlike in other scenes there is floor at several heights, and a scan is made from each of
// `starts`. One scene each: stairs seen from below, and from above; a ramp; a step; a mezzanine;
// the edge of a stairwell; a pit; a platform; the same with a glass balustrade; two storeys without
// a way between them; an atrium; two storeys joined by stairs.
std::vector<Scene> EdgeScenes();

// Blocks of 1.2 m at random heights, that fill a hall or stand in the middle of one: pits, drops,
// steps and plinths, at times under an upper storey, with parapets of stone or glass.
Scene RandomEdgeScene(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_EDGE_SCENES_H_
