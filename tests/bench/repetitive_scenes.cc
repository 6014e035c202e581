#include "tests/bench/repetitive_scenes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr double kOutOfReach = 60;  // m, half of what is longer than ranges

}  // namespace

RepetitiveScene PillarCorridor(uint64_t seed, uint64_t marks) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 71);
  RepetitiveScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  const double half = random.Between(1.0, 1.7);
  const double height = random.Between(2.4, 3.2);
  scene.bay = random.Between(1.5, 4.0);
  builder.Box({-kOutOfReach, -half, 0}, {kOutOfReach, half, height});
  const double depth = random.Between(0.12, 0.35);
  const double width = random.Between(0.25, 0.6);
  for (double x = -kOutOfReach; x + width < kOutOfReach; x += scene.bay) {
    builder.Box({x, -half, 0}, {x + width, -half + depth, height});
    builder.Box({x, half - depth, 0}, {x + width, half, height});
  }
  for (uint64_t i = 0; i < marks; ++i) {
    const double x = random.Between(-12, 16);
    const double side = random.Chance(0.5) ? -half + depth : half - depth - 0.25;
    const double z = random.Between(0, 1.5);
    builder.Box({x, side, z}, {x + random.Between(0.3, 0.9), side + 0.25, z + 0.8});
  }
  const double eye = 1.5;
  scene.scanned = {{0, 0.1, eye}, {random.Between(2.5, 4), -0.1, eye}};
  for (int i = 0; i < 3; ++i) {
    scene.places.emplace_back(random.Between(3, 9), random.Between(-0.2, 0.2), eye);
  }
  return scene;
}

RepetitiveScene DoorCorridor(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 75);
  RepetitiveScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  constexpr double kLength = 39;
  const double half = random.Between(0.9, 1.4);
  const double height = random.Between(2.5, 3.0);
  scene.bay = random.Between(2.4, 4.5);
  builder.Box({0, -half, 0}, {kLength, half, height});
  const double proud = random.Between(0.03, 0.08);
  constexpr double kFrame = 0.08;
  for (double x = 1; x + 1.2 < kLength; x += scene.bay) {
    for (const double side : {-1.0, 1.0}) {
      if (random.Chance(0.15)) continue;  // no door here
      const double wall = side * half;
      const double front = side * (half - proud);
      const auto part = [&](double from, double to, double low, double high) {
        builder.Box({from, std::min(wall, front), low}, {to, std::max(wall, front), high});
      };
      part(x, x + kFrame, 0, 2.1);
      part(x + 0.9 + kFrame, x + 0.9 + 2 * kFrame, 0, 2.1);
      part(x, x + 0.9 + 2 * kFrame, 2.02, 2.1);
    }
  }
  const double eye = 1.5;
  const double at = random.Between(3, 30);
  scene.scanned = {{at, 0.1, eye}, {at + random.Between(2.5, 4), -0.1, eye}};
  for (int i = 0; i < 3; ++i) {
    scene.places.emplace_back(at + random.Between(1, 6), random.Between(-0.2, 0.2), eye);
  }
  return scene;
}

RepetitiveScene ParkingDeck(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 72);
  RepetitiveScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  scene.bay = random.Between(3.5, 6.0);
  const double width = random.Between(0.3, 0.6);
  const double height = random.Between(2.3, 2.8);
  builder.Box({-kOutOfReach, -kOutOfReach, 0}, {kOutOfReach, kOutOfReach, height});
  const int bays = static_cast<int>(kOutOfReach / scene.bay);
  for (int x = -bays; x <= bays; ++x) {
    for (int y = -bays; y <= bays; ++y) {
      const Vector3d low((x + 0.5) * scene.bay, (y + 0.5) * scene.bay, 0);
      builder.Box(low, low + Vector3d(width, width, height));
    }
  }
  const double eye = 1.5;
  scene.scanned = {{0, 0, eye}, {0.8 * scene.bay, 0.3, eye}};
  for (int i = 0; i < 3; ++i) {
    scene.places.emplace_back(random.Between(-1.5, 1.5) * scene.bay / 2 + 3,
                              random.Between(-0.3, 0.3) * scene.bay, eye);
  }
  return scene;
}

RepetitiveScene AroundStart(simulation::Scene of, uint64_t seed) {
  RepetitiveScene scene;
  const simulation::SimulatedScanner tracer(of.mesh);
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 74);
  scene.scanned = {of.starts[0]};
  for (int tries = 0; tries < 1000 && scene.places.size() < 6; ++tries) {
    const double reach = scene.places.size() < 2 ? 1.0 : 4.5;  // m
    const Vector3d at =
        of.starts[0] + Vector3d(random.Between(-reach, reach), random.Between(-reach, reach), 0);
    if (tracer.Clearance(at, 0.35) >= 0.35 && tracer.Visible(of.starts[0], at)) {
      scene.places.push_back(at);
    }
  }
  scene.mesh = std::move(of.mesh);
  return scene;
}

RepetitiveScene Changed(RepetitiveScene scene, Change change, uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 77);
  const simulation::SimulatedScanner tracer(scene.mesh);
  simulation::TriangleMesh first = scene.mesh;
  simulation::TriangleMesh later = scene.mesh;
  simulation::MeshBuilder before(first);
  simulation::MeshBuilder after(later);
  const Vector3d middle = scene.scanned.front();
  // A place on the floor in sight of the stations, with room around it.
  const auto place = [&](double room, double reach) {
    for (int tries = 0; tries < 2000; ++tries) {
      const double away = random.Between(1.0, reach);
      const double azimuth = random.Between(0, 2 * sensor::kPi);
      Vector3d at = middle + away * Vector3d(std::cos(azimuth), std::sin(azimuth), 0);
      const bool near = std::any_of(scene.places.begin(), scene.places.end(),
                                    [&](const auto& p) { return (p - at).norm() < room + 0.4; });
      if (!near && tracer.Clearance(at, room) >= room && tracer.Visible(middle, at)) return at;
    }
    return Vector3d(middle);
  };
  const auto on_floor = [&](const Vector3d& at) { return Vector3d(at.x(), at.y(), 0); };
  switch (change) {
    case Change::kPeopleCame:
    case Change::kPeopleLeft:
      for (int i = 0; i < 10; ++i) {
        const Vector3d at = place(0.25, 6);
        if (at == middle) continue;
        (change == Change::kPeopleCame ? after : before)
            .TurnedBox(on_floor(at), {0.45, 0.28, 1.72}, random.Between(0, sensor::kPi));
      }
      break;
    case Change::kDoorShut: {
      const Vector3d at = place(0.46, 5);
      if (at != middle) after.TurnedBox(on_floor(at), {0.9, 0.04, 2.05}, random.Between(0, 3));
      break;
    }
    case Change::kCupboardMoved: {
      const Vector3d at = place(0.7, 5);
      if (at == middle) break;
      const double yaw = random.Between(0, sensor::kPi);
      before.TurnedBox(on_floor(at), {1.2, 0.5, 1.9}, yaw);
      after.TurnedBox(on_floor(at) + 0.7 * Vector3d(std::cos(yaw), std::sin(yaw), 0),
                      {1.2, 0.5, 1.9}, yaw);
      break;
    }
    case Change::kCar: {
      const Vector3d at = place(1.2, 9);
      if (at == middle) break;
      const double yaw = random.Between(0, sensor::kPi);
      after.TurnedBox(on_floor(at), {4.4, 1.8, 0.8}, yaw);
      after.TurnedBox(on_floor(at) + Vector3d(0, 0, 0.8), {2.2, 1.6, 0.6}, yaw);
      break;
    }
  }
  scene.mesh = std::move(first);
  scene.later = std::move(later);
  return scene;
}

}  // namespace vantage::bench
