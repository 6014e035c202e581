// The places where a scanner can stand in a scene, which only the simulation knows.
#ifndef VANTAGE_CORE_SIMULATION_STANDABLE_POSITIONS_H_
#define VANTAGE_CORE_SIMULATION_STANDABLE_POSITIONS_H_

#include <Eigen/Geometry>
#include <vector>

#include "core/simulation/simulated_scanner.h"

namespace vantage::simulation {

// Places where the scanner can really stand, m, scene frame: a lattice of `spacing` over the floor,
// at `height` over it, with the floor below, and free within `clearance` from 5 cm over the floor
// up to the viewpoint; and connected to `start` by a way that is free within min(clearance, 0.3 m)
// and never further than 10 cm off the lattice of the search. `start` itself need not be on the
// lattice.
std::vector<Eigen::Vector3d> StandablePositions(const SimulatedScanner& tracer,
                                                const Eigen::AlignedBox3d& bounds,
                                                const Eigen::Vector3d& start, double floor_height,
                                                double height, double clearance, double spacing);

// The same where the floor or the ground is not level: `height` is over what lies straight below,
// and the way from `start`, which is above it, goes up and down by at most 0.2 m to a step of 0.2
// m.
std::vector<Eigen::Vector3d> StandablePositionsOnGround(const SimulatedScanner& tracer,
                                                        const Eigen::AlignedBox3d& bounds,
                                                        const Eigen::Vector3d& start, double height,
                                                        double clearance, double spacing);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_STANDABLE_POSITIONS_H_
