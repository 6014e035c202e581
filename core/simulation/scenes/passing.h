// People and doors, which may have moved when the next scan is made.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_PASSING_H_
#define VANTAGE_CORE_SIMULATION_SCENES_PASSING_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulation {

// Somebody who stands at `foot` (m, builder's frame) and faces `yaw` (rad): 1.75 m tall, half a
// metre wide.
void AddPerson(const Eigen::Vector3d& foot, double yaw, MeshBuilder& builder);

// A door leaf of 4 cm about an upright hinge.
struct DoorLeaf {
  Eigen::Vector3d hinge = Eigen::Vector3d::Zero();  // m, on the floor
  double width = 0.9;                               // m
  double height = 1.98;                             // m
  double closed_yaw = 0;                            // rad, where the closed leaf points from there
};
// As it stands at `angle` (rad) from closed.
void AddDoorLeaf(const DoorLeaf& leaf, double angle, MeshBuilder& builder);

// Where the operator happens to stand while a scan is made: on the floor, 1.2 to 2.5 m from the
// scanner, with 30 cm of free space around. The same seed gives the same place; nothing when a
// hundred tries find none. `tracer` is of the scene without people.
std::optional<Eigen::Vector3d> OperatorPlace(const SimulatedScanner& tracer,
                                             const Eigen::Vector3d& scanner, double floor_height,
                                             uint64_t seed);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_PASSING_H_
