#include "core/simulation/scenes/outdoor_scenes.h"

#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kGround = 0.3;      // m, thickness of the ground
constexpr double kViewHeight = 1.5;  // m

// A house in a frame of its own: its front lies in the plane y = 0 and faces -y, x runs along it.
struct House {
  double width = 12;
  double depth = 8;
  double eaves = 6;  // m, height of the walls
  double ridge = 0;  // m over the eaves; 0: a flat roof
};

// A row of windows in the front: a pane in a frame that stands out from the wall, so that the wall
// behind it is hidden and the pane returns nothing.
void AddWindows(const House& house, double sill, double height, double width, double gap,
                MeshBuilder& builder) {
  const int count = static_cast<int>((house.width - gap) / (width + gap));
  const double first = 0.5 * (house.width - count * (width + gap) + gap);
  for (int i = 0; i < count; ++i) {
    const double x = first + i * (width + gap);
    const double y = -0.08;
    const auto bar = [&](double x0, double z0, double x1, double z1) {
      builder.Box({x0, y, z0}, {x1, 0.01, z1});
    };
    bar(x - 0.08, sill - 0.08, x + width + 0.08, sill);
    bar(x - 0.08, sill + height, x + width + 0.08, sill + height + 0.08);
    bar(x - 0.08, sill, x, sill + height);
    bar(x + width, sill, x + width + 0.08, sill + height);
    builder.Quad({Vector3d(x, 0.5 * y, sill), Vector3d(x + width, 0.5 * y, sill),
                  Vector3d(x + width, 0.5 * y, sill + height), Vector3d(x, 0.5 * y, sill + height)},
                 Material::kGlass);
  }
}

void AddHouse(const House& house, MeshBuilder& builder) {
  builder.Box({0, 0, -kGround}, {house.width, house.depth, house.eaves});
  if (house.ridge <= 0) return;
  // The roof stands out over front and back, as thick as a hand.
  constexpr double kEaves = 0.4;
  constexpr double kThick = 0.15;
  const double slope = house.ridge / (0.5 * house.depth);
  const double low = house.eaves - slope * kEaves;
  const double middle = 0.5 * house.depth;
  const double top = house.eaves + house.ridge;
  for (const double z : {0.0, kThick}) {
    builder.Quad({Vector3d(-0.2, -kEaves, low + z), Vector3d(house.width + 0.2, -kEaves, low + z),
                  Vector3d(house.width + 0.2, middle, top + z), Vector3d(-0.2, middle, top + z)});
    const double back = house.depth + kEaves;
    builder.Quad({Vector3d(-0.2, back, low + z), Vector3d(house.width + 0.2, back, low + z),
                  Vector3d(house.width + 0.2, middle, top + z), Vector3d(-0.2, middle, top + z)});
  }
  for (const double y : {-kEaves, house.depth + kEaves}) {
    builder.Quad({Vector3d(-0.2, y, low), Vector3d(house.width + 0.2, y, low),
                  Vector3d(house.width + 0.2, y, low + kThick), Vector3d(-0.2, y, low + kThick)});
  }
  // Gables.
  for (const double x : {0.0, house.width}) {
    builder.Quad({Vector3d(x, 0, house.eaves), Vector3d(x, house.depth, house.eaves),
                  Vector3d(x, middle + 0.01, top), Vector3d(x, middle - 0.01, top)});
  }
}

Eigen::Isometry3d At(double x, double y, double z, double yaw) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Vector3d(x, y, z));
  T.rotate(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
  return T;
}

void AddCar(double x, double y, double yaw, double height, MeshBuilder& builder) {
  builder.TurnedBox({x, y, 0.25}, {4.2, 1.8, height - 0.25}, yaw);
  builder.TurnedBox({x, y, 0}, {3.4, 1.5, 0.25}, yaw, Material::kDark);
}

}  // namespace

Scene FacadeScene(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 41);
  Scene scene;
  scene.name = absl::StrCat("facade ", seed);
  MeshBuilder builder(scene.mesh);
  const double width = random.Between(12, 15);
  builder.Box({-5, -14, -kGround}, {width + 5, 11, 0});
  House house;
  house.width = width;
  house.depth = 7;
  house.eaves = random.Between(5.8, 6.6);
  house.ridge = random.Between(2.2, 2.8);
  AddHouse(house, builder);
  AddWindows(house, 0.9, 1.4, 1.2, random.Between(1.2, 1.6), builder);
  AddWindows(house, 3.8, 1.4, 1.2, random.Between(1.2, 1.6), builder);
  const double balcony = random.Between(0.3, 0.6) * width;
  builder.Box({balcony, -1.1, 2.9}, {balcony + 2.4, 0, 3.05});
  builder.Box({balcony, -1.1, 3.05}, {balcony + 2.4, -1.04, 4.0});
  AddCar(random.Between(2, width - 4), -random.Between(4.5, 6), random.Between(-0.3, 0.3), 1.9,
         builder);
  const double kiosk = random.Between(0, 4);
  builder.Box({kiosk, -10.5, 0}, {kiosk + 2, -8.5, 2.4});
  scene.starts = {{0.55 * width, -7.5, kViewHeight}, {0.85 * width, -9.5, kViewHeight}};
  return scene;
}

Scene CourtyardScene(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 42);
  Scene scene;
  scene.name = absl::StrCat("courtyard ", seed);
  MeshBuilder builder(scene.mesh);
  const double width = random.Between(13, 15);
  const double depth = random.Between(11, 13);
  const double height = random.Between(6.5, 8);
  constexpr double kWing = 4;
  builder.Box({-kWing, -kWing, -kGround}, {width + kWing, depth + kWing, 0});
  builder.Box({-kWing, depth, 0}, {width + kWing, depth + kWing, height});
  builder.Box({-kWing, -kWing, 0}, {0, depth, height + random.Between(-0.5, 0.5)});
  builder.Box({width, -kWing, 0}, {width + kWing, depth, height + random.Between(-0.5, 0.5)});
  const double gate = random.Between(0.3, 0.6) * width;
  builder.Box({0, -kWing, 0}, {gate, 0, height});
  builder.Box({gate + 3, -kWing, 0}, {width, 0, height});
  builder.Box({gate, -kWing, 3.4}, {gate + 3, 0, height});
  builder.Box({gate, -kWing, 0}, {gate + 3, 0.1 - kWing, 3.4});  // the gate is shut
  House north;
  north.width = width;
  builder.SetFrame(At(0, depth, 0, 0));
  AddWindows(north, 1.0, 1.5, 1.1, 1.5, builder);
  AddWindows(north, 4.2, 1.5, 1.1, 1.5, builder);
  builder.SetFrame(Eigen::Isometry3d::Identity());
  builder.Cylinder({0.3 * width, 0.65 * depth, 0}, 0.8, 0.8, 0.9);
  for (const double y : {0.25, 0.75}) {  // pilasters
    builder.Box({0, y * depth - 0.2, 0}, {0.3, y * depth + 0.2, height - 1});
  }
  scene.starts = {{0.6 * width, 0.4 * depth, kViewHeight}, {0.25 * width, 0.3 * depth, 1.5}};
  return scene;
}

Scene StreetScene(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 43);
  Scene scene;
  scene.name = absl::StrCat("street ", seed);
  MeshBuilder builder(scene.mesh);
  const double across = random.Between(9, 11);
  builder.Box({-16, -1, -kGround}, {32, across + 1, 0});
  House north;
  north.width = random.Between(14, 18);
  north.depth = 7;
  north.eaves = random.Between(6, 7.5);
  north.ridge = random.Between(1.8, 2.6);
  builder.SetFrame(At(0, across, 0, 0));
  AddHouse(north, builder);
  AddWindows(north, 0.9, 1.5, 1.2, 1.4, builder);
  AddWindows(north, 4.0, 1.4, 1.2, 1.4, builder);
  House south;
  south.width = random.Between(13, 16);
  south.depth = 7;
  south.eaves = random.Between(8, 9.5);
  builder.SetFrame(At(south.width + random.Between(0, 2), 0, 0, sensor::kPi));
  AddHouse(south, builder);
  AddWindows(south, 0.9, 1.5, 1.2, 1.4, builder);
  AddWindows(south, 4.0, 1.5, 1.2, 1.4, builder);
  builder.Box({-0.1, -0.25, south.eaves - 0.4}, {south.width + 0.1, 0.2, south.eaves + 0.6});
  builder.SetFrame(Eigen::Isometry3d::Identity());
  for (const double x : {-3.0, 9.0}) builder.Cylinder({x, 1.2, 0}, 0.08, 0.05, 5);
  AddCar(random.Between(2, 5), across - 1.5, random.Between(-0.1, 0.1), 1.5, builder);
  AddCar(random.Between(8, 12), 1.6, random.Between(-0.1, 0.1), 1.5, builder);
  scene.starts = {{6.5, 0.5 * across, kViewHeight}, {12.5, 0.6 * across, kViewHeight}};
  return scene;
}

Scene SlopeScene(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 44);
  Scene scene;
  scene.name = absl::StrCat("slope ", seed);
  MeshBuilder builder(scene.mesh);
  const double rise = random.Between(0.12, 0.16);
  const double phase = random.Between(0, 6);
  const auto ground = [&](double x, double y) {
    return rise * y + 0.25 * std::sin(0.45 * x + phase) * std::sin(0.35 * y);
  };
  constexpr double kSide = 26;  // m
  constexpr int kParts = 26;
  constexpr double kPart = kSide / kParts;
  const auto point = [&](int i, int k) {
    const double x = i * kPart - 0.5 * kSide;
    const double y = k * kPart - 0.5 * kSide;
    return Vector3d(x, y, ground(x, y));
  };
  for (int i = 0; i < kParts; ++i) {
    for (int k = 0; k < kParts; ++k) {
      builder.Quad({point(i, k), point(i + 1, k), point(i + 1, k + 1), point(i, k + 1)});
    }
  }
  // A hut up the slope, whose base reaches into the ground.
  House hut;
  hut.width = 5;
  hut.depth = 4;
  hut.eaves = 2.6;
  hut.ridge = 1.4;
  const double hut_x = random.Between(-4, 1);
  builder.SetFrame(At(hut_x, 4, ground(hut_x + 2.5, 6) + 0.1, random.Between(-0.3, 0.3)));
  AddHouse(hut, builder);
  builder.Box({0, 0, -1.2}, {hut.width, hut.depth, 0});
  AddWindows(hut, 0.9, 1.1, 1.0, 0.9, builder);
  builder.SetFrame(Eigen::Isometry3d::Identity());
  for (int i = 0; i < 5; ++i) {
    const double x = random.Between(-10, 10);
    const double y = random.Between(-10, -2);
    const double size = random.Between(0.6, 1.5);
    if (std::hypot(x, y + 5) < 2.5) continue;
    builder.TurnedBox({x, y, ground(x, y) - 0.4}, {size, 0.8 * size, 0.4 + 0.7 * size},
                      random.Between(0, 3));
  }
  builder.Box({5, -1, ground(8, -1) - 0.8}, {11, -0.7, ground(8, -1) + 1.1});  // retaining wall
  scene.floor_height = ground(0, -5);
  scene.several_levels = true;
  scene.starts = {{0, -5, ground(0, -5) + kViewHeight}, {-4, 0, ground(-4, 0) + kViewHeight}};
  return scene;
}

}  // namespace vantage::simulation
