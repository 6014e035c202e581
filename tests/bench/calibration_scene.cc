#include "tests/bench/calibration_scene.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"

namespace vantage::bench {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kOutOfSight = 1.8 * kCalibrationRange;  // m, of ends that no scan reaches
constexpr double kStationHalf = 4.0;                     // m, along what is open
constexpr double kKeepOff = 0.6;                         // m, of stations from walls
constexpr int kRound = 360;                              // facets of what is round

// Set up at tripod heights in a box.
AlignedBox3d Stations(const Vector3d& low, const Vector3d& high) {
  return {Vector3d(low.x(), low.y(), low.z() + 1.0), Vector3d(high.x(), high.y(), low.z() + 1.9)};
}

// Turned about the vertical, so that its walls do not lie along the voxels.
Eigen::Isometry3d Turned(simulation::RandomSequence& random) {
  return Eigen::Isometry3d(
      Eigen::AngleAxisd(random.Between(0, 2 * std::numbers::pi), Vector3d::UnitZ()));
}

CalibrationScene Furnished(simulation::Scene scene) {
  CalibrationScene made;
  const AlignedBox3d bounds = scene.mesh.Bounds();
  made.stations = Stations(bounds.min(), bounds.max());
  made.mesh = std::move(scene.mesh);
  return made;
}

CalibrationScene Flat(uint64_t seed) { return Furnished(simulation::FurnishedFlat(seed)); }
CalibrationScene Office(uint64_t seed) { return Furnished(simulation::OfficeStorey(seed, 150)); }
CalibrationScene Doorway(uint64_t seed) { return Furnished(simulation::TwoRooms(seed)); }
CalibrationScene Pillars(uint64_t seed) { return Furnished(simulation::PillarHall(seed)); }

// One room with crates of all sizes on its floor.
CalibrationScene Crates(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 31);
  CalibrationScene scene;
  scene.T_scene_local = Turned(random);
  simulation::MeshBuilder builder(scene.mesh);
  builder.SetFrame(scene.T_scene_local);
  const Vector3d half(random.Between(2.2, 4.5), random.Between(2.0, 3.5), 0);
  const double height = random.Between(2.3, 3.5);
  builder.Box(-half, half + Vector3d(0, 0, height));
  const uint64_t crates = 1 + random.Below(6);
  for (uint64_t i = 0; i < crates; ++i) {
    const Vector3d size(random.Between(0.3, 1.2), random.Between(0.3, 1.2),
                        random.Between(0.2, 1.8));
    const Vector3d at(random.Between(-1, 1) * half.x(), random.Between(-1, 1) * half.y(), 0);
    builder.TurnedBox(at, size, random.Between(0, std::numbers::pi));
  }
  const Vector3d off(kKeepOff, kKeepOff, 0);
  scene.stations = Stations(-half + off, half - off);
  return scene;
}

struct CorridorSize {
  double half_width;
  double height;
};
CorridorSize AddCorridor(simulation::RandomSequence& random, CalibrationScene& scene,
                         simulation::MeshBuilder& builder) {
  scene.T_scene_local = Turned(random);
  builder.SetFrame(scene.T_scene_local);
  const CorridorSize size{random.Between(0.8, 1.6), random.Between(2.2, 3.2)};
  builder.Box({-kOutOfSight, -size.half_width, 0}, {kOutOfSight, size.half_width, size.height});
  scene.stations = Stations({-kStationHalf, -size.half_width + 0.5, 0},
                            {kStationHalf, size.half_width - 0.5, size.height});
  return size;
}

// A corridor in which only flat pilasters constrain the pose along its axis.
CalibrationScene Pilasters(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 32);
  CalibrationScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  const CorridorSize size = AddCorridor(random, scene, builder);
  const double depth = random.Between(0.05, 0.35);
  const double spacing = random.Between(1.5, 3.0);
  const double width = random.Between(0.3, 0.8);
  for (double x = -kOutOfSight; x < kOutOfSight; x += spacing * random.Between(0.6, 1.4)) {
    const double side = random.Chance(0.5) ? -size.half_width : size.half_width - depth;
    builder.Box({x, side, 0}, {x + width, side + depth, size.height});
  }
  scene.stations.min().y() += 0.1;
  scene.stations.max().y() -= 0.1;
  return scene;
}

CalibrationScene Corridor(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 33);
  CalibrationScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  AddCorridor(random, scene, builder);
  return scene;
}

// An upright round room.
CalibrationScene Tower(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 34);
  CalibrationScene scene;
  scene.T_scene_local = Turned(random);
  simulation::MeshBuilder builder(scene.mesh);
  builder.SetFrame(scene.T_scene_local);
  const double radius = random.Between(1.5, 5.0);
  builder.Cylinder(Vector3d::Zero(), radius, radius, random.Between(2.4, 5.0), kRound);
  const double half = std::sqrt(0.5) * (radius - 0.5);
  scene.stations = Stations({-half, -half, 0}, {half, half, 0});
  return scene;
}

// A horizontal round tunnel without a floor.
CalibrationScene Tunnel(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 35);
  CalibrationScene scene;
  scene.T_scene_local = Turned(random);
  simulation::MeshBuilder builder(scene.mesh);
  const double radius = random.Between(1.5, 4.0);
  Eigen::Isometry3d T_local_tunnel = Eigen::Isometry3d::Identity();
  T_local_tunnel.rotate(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitY()));
  builder.SetFrame(scene.T_scene_local * T_local_tunnel);
  builder.Cylinder({0, 0, -kOutOfSight}, radius, radius, 2 * kOutOfSight, kRound);
  const double half = 0.4 * radius;
  scene.stations = {Vector3d(-kStationHalf, -half, -half), Vector3d(kStationHalf, half, half)};
  return scene;
}

// A corridor under a barrel vault, wide as a nave.
CalibrationScene Nave(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 36);
  CalibrationScene scene;
  scene.T_scene_local = Turned(random);
  simulation::MeshBuilder builder(scene.mesh);
  builder.SetFrame(scene.T_scene_local);
  const double half = random.Between(1.8, 3.5);
  const double springing = random.Between(1.8, 3.0);
  const auto quad = [&](double y0, double z0, double y1, double z1) {
    builder.Quad({Vector3d(-kOutOfSight, y0, z0), Vector3d(kOutOfSight, y0, z0),
                  Vector3d(kOutOfSight, y1, z1), Vector3d(-kOutOfSight, y1, z1)});
  };
  quad(-half, 0, half, 0);
  quad(-half, 0, -half, springing);
  quad(half, 0, half, springing);
  const int facets = kRound / 2;
  for (int i = 0; i < facets; ++i) {
    const double a = std::numbers::pi * i / facets;
    const double b = std::numbers::pi * (i + 1) / facets;
    quad(half * std::cos(a), springing + half * std::sin(a), half * std::cos(b),
         springing + half * std::sin(b));
  }
  scene.stations =
      Stations({-kStationHalf, -half + kKeepOff, 0}, {kStationHalf, half - kKeepOff, 0});
  return scene;
}

// Floor and ceiling; the walls are too far off to be measured.
CalibrationScene BareHall(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 37);
  CalibrationScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  builder.Box({-kOutOfSight, -kOutOfSight, 0},
              {kOutOfSight, kOutOfSight, random.Between(2.8, 5.0)});
  scene.stations = Stations({-kStationHalf, -kStationHalf, 0}, {kStationHalf, kStationHalf, 0});
  return scene;
}

// Outdoors: the ground and one long wall.
CalibrationScene Yard(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 38);
  CalibrationScene scene;
  scene.T_scene_local = Turned(random);
  simulation::MeshBuilder builder(scene.mesh);
  builder.SetFrame(scene.T_scene_local);
  builder.Box({-kOutOfSight, -kOutOfSight, -0.3}, {kOutOfSight, kOutOfSight, 0});
  builder.Box({-kOutOfSight, 3, -0.3}, {kOutOfSight, 3.3, random.Between(2.5, 8.0)});
  scene.stations = Stations({-kStationHalf, -2, 0}, {kStationHalf, 3 - kKeepOff, 0});
  return scene;
}

constexpr std::array<SceneFamily, 12> kFamilies = {{
    {"flat", false, "", Flat},
    {"office", false, "", Office},
    {"doorway", false, "", Doorway},
    {"pillars", false, "", Pillars},
    {"crates", false, "", Crates},
    {"pilasters", false, "", Pilasters},
    {"corridor", true, "along its axis", Corridor},
    {"nave", true, "along its axis", Nave},
    {"yard", true, "along its wall", Yard},
    {"tunnel", true, "along and about its axis", Tunnel},
    {"tower", true, "about the vertical", Tower},
    {"bare-hall", true, "across the floor and about the vertical", BareHall},
}};

}  // namespace

std::span<const SceneFamily> CalibrationFamilies() { return kFamilies; }

}  // namespace vantage::bench
