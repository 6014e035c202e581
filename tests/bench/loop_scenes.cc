#include "tests/bench/loop_scenes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/sensor/scanner_model.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;
using simulation::MeshBuilder;
using simulation::RandomSequence;

constexpr double kEye = 1.5;  // m, of a scanner over the floor

// One side of a rectangular ring: its middle line leads along x from 0 to `length`, the inside of
// the ring is on the left.
struct RingSide {
  Eigen::Isometry3d T_scene_side = Eigen::Isometry3d::Identity();
  double length = 0;  // m
};
std::array<RingSide, 4> SidesOf(double length, double width) {
  const std::array<Vector3d, 4> corners = {Vector3d(0, 0, 0), Vector3d(length, 0, 0),
                                           Vector3d(length, width, 0), Vector3d(0, width, 0)};
  std::array<RingSide, 4> sides;
  for (size_t k = 0; k < 4; ++k) {
    sides[k].T_scene_side.translate(corners[k]);
    sides[k].T_scene_side.rotate(
        Eigen::AngleAxisd(0.5 * sensor::kPi * static_cast<double>(k), Vector3d::UnitZ()));
    sides[k].length = k % 2 == 0 ? length : width;
  }
  return sides;
}

void AddStations(const std::array<RingSide, 4>& sides, double step, double aside,
                 RandomSequence& random, std::vector<Vector3d>& stations) {
  double along = 0;
  for (const RingSide& side : sides) {
    for (; along < side.length; along += step) {
      stations.push_back(side.T_scene_side * Vector3d(along, random.Between(-aside, aside), kEye));
    }
    along -= side.length;
  }
}

}  // namespace

LoopScene RingCorridor(uint64_t seed) {
  RandomSequence random(simulation::MixBits(seed) ^ 81);
  constexpr double kLength = 60;
  constexpr double kWidth = 40;
  const double half = random.Between(1.0, 1.4);
  const double height = random.Between(2.5, 3.0);
  LoopScene scene;
  MeshBuilder builder(scene.mesh);
  builder.Box({-half, -half, 0}, {kLength + half, kWidth + half, height});
  builder.Box({half, half, 0}, {kLength - half, kWidth - half, height});
  const auto sides = SidesOf(kLength, kWidth);
  for (const RingSide& side : sides) {
    builder.SetFrame(side.T_scene_side);
    for (const double wall : {-1.0, 1.0}) {
      const auto add = [&](double from, double to, double deep, double low, double high) {
        const double front = wall * (half - deep);
        const double back = wall * half;
        builder.Box({from, std::min(front, back), low}, {to, std::max(front, back), high});
      };
      for (double x = half + random.Between(0.3, 2); x + 1.5 < side.length - half;
           x += random.Between(1.6, 4.5)) {
        const double kind = random.Uniform();
        if (kind < 0.3) {
          add(x, x + random.Between(0.3, 0.5), random.Between(0.1, 0.25), 0, height);
        } else if (kind < 0.55) {
          add(x, x + random.Between(0.5, 1.2), random.Between(0.25, 0.4), 0,
              random.Between(0.8, 2.0));
        } else {
          const double proud = random.Between(0.03, 0.08);
          add(x, x + 0.08, proud, 0, 2.1);
          add(x + 0.98, x + 1.06, proud, 0, 2.1);
          add(x, x + 1.06, proud, 2.02, 2.1);
        }
      }
    }
  }
  AddStations(sides, 5.0, 0.2, random, scene.stations);
  return scene;
}

LoopScene StoreysByStairs(uint64_t seed) {
  RandomSequence random(simulation::MixBits(seed) ^ 82);
  constexpr double kFloor = 3.1;  // m, from floor to floor
  constexpr double kClear = 2.8;  // m, from floor to ceiling
  constexpr double kLong = 12;    // m, along x
  constexpr double kWide = 8;     // m, along y
  constexpr double kWellFrom = 1.2;
  constexpr double kWellTo = 4.5;
  constexpr double kWellWide = 2.4;
  LoopScene scene;
  MeshBuilder builder(scene.mesh);
  const auto level = [&](double x0, double y0, double x1, double y1, double z) {
    builder.Quad(
        {Vector3d(x0, y0, z), Vector3d(x1, y0, z), Vector3d(x1, y1, z), Vector3d(x0, y1, z)});
  };
  const auto slab = [&](double z, bool well) {
    if (!well) {
      level(0, 0, kLong, kWide, z);
      return;
    }
    level(0, kWellWide, kLong, kWide, z);
    level(0, 0, kWellFrom, kWellWide, z);
    level(kWellTo, 0, kLong, kWellWide, z);
  };
  const auto wall = [&](double x0, double y0, double x1, double y1, double low, double high) {
    builder.Quad({Vector3d(x0, y0, low), Vector3d(x1, y1, low), Vector3d(x1, y1, high),
                  Vector3d(x0, y0, high)});
  };
  const double top = 2 * kFloor + kClear;
  wall(0, 0, kLong, 0, 0, top);
  wall(kLong, 0, kLong, kWide, 0, top);
  wall(kLong, kWide, 0, kWide, 0, top);
  wall(0, kWide, 0, 0, 0, top);
  for (int storey = 0; storey < 3; ++storey) {
    const double z = kFloor * storey;
    slab(z, storey > 0);
    slab(z + kClear, storey < 2);
    if (storey < 2) {  // the well's sides, between ceiling and floor
      wall(kWellFrom, 0, kWellFrom, kWellWide, z + kClear, z + kFloor);
      wall(kWellTo, 0, kWellTo, kWellWide, z + kClear, z + kFloor);
      wall(kWellFrom, kWellWide, kWellTo, kWellWide, z + kClear, z + kFloor);
      // A flight along one wall, the next one beside it.
      const double y = storey == 0 ? 0.0 : 1.25;
      constexpr int kSteps = 16;
      constexpr double kRun = (kWellTo - kWellFrom) / kSteps;
      for (int step = 0; step < kSteps; ++step) {
        const double x = kWellTo - kRun * (step + 1);
        const double rise = kFloor * (step + 1) / (kSteps + 1);
        builder.Box({x, y, z + rise - 0.2}, {x + kRun, y + 1.1, z + rise});
      }
    }
    // A partition with a wide opening, and furniture away from where scans are made.
    const double partition = random.Between(6.2, 7.0);
    builder.Box({partition, 0, z}, {partition + 0.12, 2.6, z + kClear});
    builder.Box({partition, 5.0, z}, {partition + 0.12, kWide, z + kClear});
    std::vector<Vector3d> stations = {{10.3, 6.1, 0}, {10.2, 2.0, 0}, {8.3, 3.9, 0},
                                      {5.3, 3.8, 0},  {3.2, 6.2, 0},  {1.5, 3.6, 0}};
    for (Vector3d& at : stations) {
      at += Vector3d(random.Between(-0.2, 0.2), random.Between(-0.2, 0.2), z + kEye);
    }
    if (storey == 1) std::reverse(stations.begin(), stations.end());
    for (int k = 0; k < 10; ++k) {
      const Vector3d base(random.Between(0.6, kLong - 0.6), random.Between(2.9, kWide - 0.4), z);
      const Vector3d size(random.Between(0.4, 1.2), random.Between(0.4, 0.8),
                          random.Between(0.5, 2.0));
      if (std::any_of(stations.begin(), stations.end(),
                      [&](const Vector3d& at) { return (at - base).head<2>().norm() < 1.2; })) {
        continue;
      }
      builder.TurnedBox(base, size, random.Between(0, sensor::kPi));
    }
    if (storey == 1) {
      // Up by the first flight, then round the storey, and to the second.
      scene.stations.emplace_back(0.65, 2.0, z + kEye);
      scene.stations.insert(scene.stations.end(), stations.begin(), stations.end());
      scene.stations.emplace_back(5.3, 1.8, z + kEye);
      scene.stations.emplace_back(2.7, 1.8, z + 1.75 + kEye);
    } else if (storey == 0) {
      scene.stations.insert(scene.stations.end(), stations.begin(), stations.end());
      scene.stations.emplace_back(5.3, 0.9, z + kEye);
      scene.stations.emplace_back(2.7, 0.55, z + 1.75 + kEye);
    } else {
      scene.stations.emplace_back(0.65, 2.0, z + kEye);
      std::reverse(stations.begin(), stations.end());
      scene.stations.insert(scene.stations.end(), stations.begin(), stations.end());
    }
  }
  return scene;
}

LoopScene StreetAroundBlock(uint64_t seed) {
  RandomSequence random(simulation::MixBits(seed) ^ 83);
  constexpr double kLength = 60;  // m, of the street's middle line
  constexpr double kWidth = 40;
  constexpr double kHalf = 5;
  LoopScene scene;
  MeshBuilder builder(scene.mesh);
  constexpr double kOut = 30;  // m, depth of the houses around
  builder.Quad({Vector3d(-kOut, -kOut, 0), Vector3d(kLength + kOut, -kOut, 0),
                Vector3d(kLength + kOut, kWidth + kOut, 0), Vector3d(-kOut, kWidth + kOut, 0)});
  builder.Box({kHalf, kHalf, 0}, {kLength - kHalf, kWidth - kHalf, random.Between(9, 14)});
  const auto sides = SidesOf(kLength, kWidth);
  for (const RingSide& side : sides) {
    builder.SetFrame(side.T_scene_side);
    builder.Box({-kHalf, -kOut, 0}, {side.length + kHalf, -kHalf, random.Between(8, 14)});
    for (const double wall : {-1.0, 1.0}) {
      for (double x = kHalf + random.Between(0.5, 2); x + 2.5 < side.length - kHalf;
           x += random.Between(2.2, 5.0)) {
        const double deep = random.Between(0.08, 0.35);
        const double wide = random.Between(0.8, 2.0);
        const double low = random.Chance(0.4) ? 0.0 : random.Between(0.8, 1.4);
        const double high = low + random.Between(1.4, 2.4);
        const double front = wall * (kHalf - deep);
        const double back = wall * kHalf;
        builder.Box({x, std::min(front, back), low}, {x + wide, std::max(front, back), high});
      }
      for (double x = 4; x + 5 < side.length; x += random.Between(6, 14)) {
        if (random.Chance(0.5)) {
          builder.Box({x, wall * 3.4 - 0.85, 0.2}, {x + 4.2, wall * 3.4 + 0.85, 1.4});
        } else {
          builder.Cylinder({x, wall * 4.2, 0}, 0.08, 0.06, 5);
        }
      }
    }
  }
  AddStations(sides, 7.0, 0.4, random, scene.stations);
  return scene;
}

}  // namespace vantage::bench
