#include "core/simulation/scenes/edge_scenes.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kWall = 0.2;  // m, of walls, slabs and floors

// Walls around [0, width] x [0, depth] from `low` to `high`, m.
void AddWalls(double width, double depth, double low, double high, MeshBuilder& builder) {
  builder.Box({-kWall, -kWall, low}, {0, depth + kWall, high});
  builder.Box({width, -kWall, low}, {width + kWall, depth + kWall, high});
  builder.Box({0, -kWall, low}, {width, 0, high});
  builder.Box({0, depth, low}, {width, depth + kWall, high});
}

// A slab whose upper side is at `z`, over [0, width] x [0, depth] but for the hole, m.
void AddSlab(double width, double depth, double z, const Eigen::AlignedBox2d& hole,
             MeshBuilder& builder) {
  const auto part = [&](double x0, double y0, double x1, double y1) {
    if (x1 > x0 && y1 > y0) builder.Box({x0, y0, z - kWall}, {x1, y1, z});
  };
  part(0, 0, hole.min().x(), depth);
  part(hole.max().x(), 0, width, depth);
  part(hole.min().x(), 0, hole.max().x(), hole.min().y());
  part(hole.min().x(), hole.max().y(), hole.max().x(), depth);
}

// A room of [0, width] x [0, depth] x [0, height], m.
void AddRoom(double width, double depth, double height, MeshBuilder& builder) {
  builder.Box({-kWall, -kWall, -kWall}, {width + kWall, depth + kWall, 0});
  builder.Box({-kWall, -kWall, height}, {width + kWall, depth + kWall, height + kWall});
  AddWalls(width, depth, 0, height, builder);
}

// Solid steps from x0 on up along x, m.
void AddSteps(double x0, double y0, double y1, int count, double rise, double going,
              MeshBuilder& builder) {
  for (int k = 1; k <= count; ++k) {
    builder.Box({x0 + (k - 1) * going, y0, 0}, {x0 + k * going, y1, k * rise});
  }
}

template <typename Build>
Scene Make(std::string name, std::vector<Vector3d> starts, const Build& build) {
  Scene scene;
  scene.name = std::move(name);
  scene.starts = std::move(starts);
  MeshBuilder builder(scene.mesh);
  build(builder);
  return scene;
}

Scene Stairs(std::string name, std::vector<Vector3d> starts) {
  return Make(std::move(name), std::move(starts), [](MeshBuilder& builder) {
    AddRoom(8, 5, 4.4, builder);
    AddSteps(2, 1.5, 3.5, 9, 0.17, 0.28, builder);
    builder.Box({2 + 9 * 0.28, 0, 0}, {8, 5, 10 * 0.17});
  });
}

Scene Platform(std::string name, bool balustrade) {
  return Make(std::move(name), {{2.5, 2.5, 1.5}, {4.2, 1.2, 1.5}}, [&](MeshBuilder& builder) {
    builder.SetFrame(Eigen::Isometry3d(Eigen::Translation3d(-6, -6, -3)));
    AddRoom(17, 17, 8, builder);
    builder.SetFrame(Eigen::Isometry3d::Identity());
    builder.Box({0, 0, -3}, {5, 5, 0});
    builder.Box({-0.2, 0, 0}, {0, 5, 2.5});  // a wall along one side
    if (!balustrade) return;
    const auto pane = [&](const Vector3d& a, const Vector3d& b) {
      builder.Quad({a, b, b + Vector3d(0, 0, 1), a + Vector3d(0, 0, 1)}, Material::kGlass);
    };
    pane({0, 0.03, 0}, {4.97, 0.03, 0});
    pane({4.97, 0.03, 0}, {4.97, 4.97, 0});
    pane({0, 4.97, 0}, {4.97, 4.97, 0});
  });
}

}  // namespace

std::vector<Scene> EdgeScenes() {
  std::vector<Scene> scenes;
  scenes.push_back(Stairs("stairs up", {{1.0, 2.5, 1.5}}));
  scenes.push_back(Stairs("stairs down", {{5.9, 2.5, 1.7 + 1.5}}));
  scenes.push_back(Make("ramp", {{1.2, 1.5, 1.5}}, [](MeshBuilder& builder) {
    AddRoom(9, 3, 4, builder);
    builder.Quad({Vector3d(2, 0, 0), Vector3d(7, 0, 0.6), Vector3d(7, 3, 0.6), Vector3d(2, 3, 0)});
    builder.Box({7, 0, 0}, {9, 3, 0.6});
  }));
  scenes.push_back(Make("step", {{1.5, 2, 1.5}}, [](MeshBuilder& builder) {
    AddRoom(7, 4, 3, builder);
    builder.Box({3.5, 0, 0}, {7, 4, 0.17});
  }));
  scenes.push_back(Make("mezzanine", {{2, 3, 1.5}, {6.4, 3, 2.8 + 1.5}}, [](MeshBuilder& builder) {
    AddRoom(8, 6, 5.4, builder);
    builder.Box({4.5, 0, 2.6}, {8, 6, 2.8});
  }));
  scenes.push_back(
      Make("stairwell edge", {{1.2, 3.5, 1.5}, {5.5, 1.4, 1.5}}, [](MeshBuilder& builder) {
        AddWalls(7, 7, -2.9, 2.6, builder);
        builder.Box({0, 0, -2.9}, {7, 7, -2.7});
        builder.Box({0, 0, 2.6}, {7, 7, 2.8});
        AddSlab(7, 7, 0, {Eigen::Vector2d(2.6, 2), Eigen::Vector2d(3.6, 5)}, builder);
      }));
  scenes.push_back(Make("pit", {{1.3, 1.3, 1.5}}, [](MeshBuilder& builder) {
    AddWalls(7, 6, -1.4, 3, builder);
    builder.Box({0, 0, -1.4}, {7, 6, -1.2});
    builder.Box({0, 0, 3}, {7, 6, 3.2});
    AddSlab(7, 6, 0, {Eigen::Vector2d(3, 2), Eigen::Vector2d(4.6, 4)}, builder);
    builder.SetFrame(Eigen::Isometry3d(Eigen::Translation3d(3, 2, 0)));
    AddWalls(1.6, 2, -1.2, -kWall, builder);
    builder.SetFrame(Eigen::Isometry3d::Identity());
  }));
  scenes.push_back(Platform("platform", false));
  scenes.push_back(Platform("glass balustrade", true));
  scenes.push_back(
      Make("two storeys", {{2, 2.5, 1.5}, {3.5, 2.5, 2.8 + 1.5}}, [](MeshBuilder& builder) {
        AddRoom(6, 5, 5.4, builder);
        builder.Box({0, 0, 2.6}, {6, 5, 2.8});
      }));
  scenes.push_back(Make("atrium", {{2.5, 4, 1.5}, {1.2, 4, 2.8 + 1.5}}, [](MeshBuilder& builder) {
    AddRoom(8, 8, 5.4, builder);
    AddSlab(8, 8, 2.8, {Eigen::Vector2d(2.5, 2.5), Eigen::Vector2d(5.5, 5.5)}, builder);
  }));
  scenes.push_back(
      Make("house", {{0.5, 0.75, 1.5}, {4.4, 1.5, 1.4 + 1.5}, {0.6, 2.25, 2.8 + 1.5}},
           [](MeshBuilder& builder) {
             constexpr double kGoing = 0.28;
             constexpr double kRise = 0.175;
             AddRoom(8, 6, 5.4, builder);
             // Two flights of eight risers, up along x and back, with a landing between them.
             AddSteps(1.5, 0, 1.5, 7, kRise, kGoing, builder);
             const double landing = 1.5 + 7 * kGoing;
             builder.Box({landing, 0, 0}, {5.3, 3, 8 * kRise});
             for (int k = 1; k <= 7; ++k) {
               builder.Box({landing - k * kGoing, 1.5, 0},
                           {landing - (k - 1) * kGoing, 3, (8 + k) * kRise});
             }
             AddSlab(8, 6, 2.8, {Eigen::Vector2d(1.5, 0), Eigen::Vector2d(5.3, 3)}, builder);
           }));
  return scenes;
}

Scene RandomEdgeScene(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 27);
  constexpr int kBlocks = 6;      // along x and y
  constexpr double kEdge = 1.2;   // m
  constexpr double kDeep = -3.2;  // m, lower than any pit
  Scene scene;
  scene.name = absl::StrCat("edges ", seed);
  MeshBuilder builder(scene.mesh);
  const double drop = random.Between(-3.0, -0.5);
  std::array<std::array<double, kBlocks>, kBlocks> height{};
  for (auto& row : height) {
    for (double& z : row) {
      const double u = random.Uniform();
      z = u < 0.6 ? 0 : u < 0.72 ? drop : u < 0.8 ? 0.16 : u < 0.88 ? -0.16 : u < 0.94 ? 0.75 : -1;
    }
  }
  // Room to stand in for a first scan, and for a second one in another corner.
  height[1][1] = height[1][2] = height[2][1] = height[2][2] = 0;
  height[4][4] = height[4][3] = 0;
  for (int y = 0; y < kBlocks; ++y) {
    for (int x = 0; x < kBlocks; ++x) {
      const auto z = height[static_cast<size_t>(y)][static_cast<size_t>(x)];
      builder.Box({x * kEdge, y * kEdge, kDeep}, {(x + 1) * kEdge, (y + 1) * kEdge, z});
    }
  }
  const double side = kBlocks * kEdge;
  // The walls stand around the blocks or five metres off, with a drop all around.
  const double around = random.Chance(0.5) ? 5 : 0;
  builder.SetFrame(Eigen::Isometry3d(Eigen::Translation3d(-around, -around, 0)));
  AddWalls(side + 2 * around, side + 2 * around, kDeep, 5.6, builder);
  builder.Box({0, 0, 5.6}, {side + 2 * around, side + 2 * around, 5.8});
  if (around > 0) builder.Box({0, 0, drop - kWall}, {side + 10, side + 10, drop});
  builder.SetFrame(Eigen::Isometry3d::Identity());
  // Parapets along some of the edges between blocks.
  for (int k = 0; k < 4; ++k) {
    const double x = kEdge * static_cast<double>(3 + random.Below(3));
    const double y = kEdge * static_cast<double>(random.Below(kBlocks - 1));
    if (random.Chance(0.5)) {
      builder.Box({x - 0.05, y, 0}, {x + 0.05, y + kEdge, 1});
    } else {
      builder.Quad({Vector3d(x, y, 0), Vector3d(x, y + kEdge, 0), Vector3d(x, y + kEdge, 1),
                    Vector3d(x, y, 1)},
                   Material::kGlass);
    }
  }
  scene.starts = {{1.9, 1.9, 1.5}, {3.5 * kEdge, 4.5 * kEdge, 1.5}};
  if (random.Chance(0.4)) {  // an upper storey over one half, with a scan from it
    builder.Box({3 * kEdge, 0, 2.5}, {side, side, 2.7});
    scene.starts.emplace_back(4.5 * kEdge, 3 * kEdge, 2.7 + 1.5);
  }
  return scene;
}

}  // namespace vantage::simulation
