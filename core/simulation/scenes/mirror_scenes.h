// Rooms with mirrors of all sizes, hidden in part or not, and openings that are easily taken for
// mirrors.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_MIRROR_SCENES_H_
#define VANTAGE_CORE_SIMULATION_SCENES_MIRROR_SCENES_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

struct MirrorScene {
  Scene scene;  // with five starts, of which each room has at least one
  // m: doorways and hatches without panes, each as deep as its wall is thick.
  std::vector<Eigen::AlignedBox3d> openings;
};

// Two or three furnished rooms in a row, with or without a corridor beside them. One to four
// mirrors hang on walls or are the doors of wardrobes: 0.35 to 1.6 m wide, 1 to 6 cm before their
// wall, up to a degree askew; half of them have furniture before them. In four scenes of ten two of
// the rooms are mirror images of each other, with everything in them.
MirrorScene RandomMirrorScene(uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_MIRROR_SCENES_H_
