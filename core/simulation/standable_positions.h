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

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_STANDABLE_POSITIONS_H_
