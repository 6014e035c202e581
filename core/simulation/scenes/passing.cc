#include "core/simulation/scenes/passing.h"

#include <cmath>
#include <numbers>

#include "core/simulation/random_sequence.h"

namespace vantage::simulation {

void AddPerson(const Eigen::Vector3d& foot, double yaw, MeshBuilder& builder) {
  const Eigen::Isometry3d frame = builder.frame();
  Eigen::Isometry3d T = frame;
  T.translate(foot);
  T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  builder.SetFrame(T);
  for (const double side : {-1.0, 1.0}) {
    builder.Cylinder({0, side * 0.1, 0}, 0.07, 0.09, 0.85, 10);
    builder.Cylinder({0, side * 0.25, 0.75}, 0.04, 0.05, 0.7, 8);
  }
  builder.Cylinder({0, 0, 0.85}, 0.18, 0.21, 0.62, 14);
  builder.Cylinder({0, 0, 1.47}, 0.1, 0.09, 0.28, 12);
  builder.SetFrame(frame);
}

void AddDoorLeaf(const DoorLeaf& leaf, double angle, MeshBuilder& builder) {
  const Eigen::Isometry3d frame = builder.frame();
  Eigen::Isometry3d T = frame;
  T.translate(leaf.hinge);
  T.rotate(Eigen::AngleAxisd(leaf.closed_yaw + angle, Eigen::Vector3d::UnitZ()));
  builder.SetFrame(T);
  builder.Box({0, -0.02, 0.01}, {leaf.width, 0.02, leaf.height});
  builder.SetFrame(frame);
}

std::optional<Eigen::Vector3d> OperatorPlace(const SimulatedScanner& tracer,
                                             const Eigen::Vector3d& scanner, double floor_height,
                                             uint64_t seed) {
  constexpr double kNeeded = 0.3;  // m of free space
  RandomSequence random(MixBits(seed) ^ 5);
  for (int attempt = 0; attempt < 100; ++attempt) {
    const double bearing = 2 * std::numbers::pi * random.Uniform();
    const double distance = random.Between(1.2, 2.5);
    const Eigen::Vector2d at =
        scanner.head<2>() + distance * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    if (!tracer.tracer().CylinderFree(at, kNeeded, floor_height + 0.02, floor_height + 1.8)) {
      continue;
    }
    if (!tracer.Visible(scanner, {at.x(), at.y(), floor_height + 1.2})) continue;
    return Eigen::Vector3d(at.x(), at.y(), floor_height);
  }
  return std::nullopt;
}

}  // namespace vantage::simulation
