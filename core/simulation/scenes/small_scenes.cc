#include "core/simulation/scenes/small_scenes.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "core/simulation/scenes/furnishing.h"

namespace vantage::simulation {
namespace {

constexpr double kOuter = 0.2;  // m, wall thickness
constexpr double kInner = 0.12;
constexpr double kPassage = 0.37;

// Walls around an extent, with the windows of the wall along low y, high x, high y, low x.
void AddOuterWalls(double width, double depth, const std::array<std::vector<Opening>, 4>& windows,
                   FloorPlan& plan) {
  const double e = 0.5 * kOuter;
  plan.AddWall({{0, e}, {width, e}, kOuter, windows[0]});
  plan.AddWall({{width - e, 0}, {width - e, depth}, kOuter, windows[1]});
  plan.AddWall({{width, depth - e}, {0, depth - e}, kOuter, windows[2]});
  plan.AddWall({{e, depth}, {e, 0}, kOuter, windows[3]});
}

Eigen::AlignedBox2d Extent(double width, double depth) {
  return {Eigen::Vector2d(0, 0), Eigen::Vector2d(width, depth)};
}

}  // namespace

Scene TwoRooms(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 2);
  const double width = random.Between(8.4, 9.4);
  const double depth = random.Between(4.2, 5.0);
  const double middle = random.Between(0.45, 0.55) * width;
  FloorPlan plan(Extent(width, depth), 2.7, kPassage);
  const Room left{
      "left",
      {Eigen::Vector2d(kOuter, kOuter), Eigen::Vector2d(middle - 0.5 * kInner, depth - kOuter)}};
  const Room right{"right",
                   {Eigen::Vector2d(middle + 0.5 * kInner, kOuter),
                    Eigen::Vector2d(width - kOuter, depth - kOuter)}};
  plan.AddRoom(left);
  plan.AddRoom(right);
  AddOuterWalls(width, depth,
                {std::vector<Opening>{Window(random.Between(1.4, 2.6), 1.4, 0.9, 2.2)},
                 std::vector<Opening>{},
                 std::vector<Opening>{Window(random.Between(1.4, 2.6), 1.4, 0.9, 2.2)},
                 std::vector<Opening>{}},
                plan);
  Wall between{{middle, 0.5 * kOuter}, {middle, depth - 0.5 * kOuter}, kInner, {}};
  between.openings.push_back(
      Doorway(between, random.Between(1.3, depth - 1.5), right.inside.center(), random));
  plan.AddWall(between);

  Scene scene;
  scene.name = absl::StrCat("two rooms ", seed);
  MeshBuilder builder(scene.mesh);
  plan.Build(builder);
  Furnishing furnishing(plan, random, builder);
  for (const Room& room : {left, right}) {
    furnishing.TableWithChairs(room, {random.Between(1.0, 1.4), 0.8, 0.75}, 2);
    furnishing.AtWall(room, {random.Between(0.8, 1.2), 0.3, random.Between(1.6, 2.0)}, AddShelf);
    furnishing.AtWall(room, {random.Between(1.0, 1.6), 0.5, random.Between(1.0, 2.0)}, AddWardrobe);
    furnishing.AtWall(room, {0.5, 0.5, 0.6}, AddClutter);
    furnishing.CeilingLamps(room, 5);
  }
  scene.starts = StartsIn(plan);
  scene.doorways = plan.Doorways();
  scene.rooms = plan.rooms();
  return scene;
}

Scene PillarHall(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 3);
  const double width = random.Between(16.5, 19.0);
  const double depth = random.Between(13.0, 15.0);
  const double height = random.Between(4.0, 4.4);
  FloorPlan plan(Extent(width, depth), height, kPassage);
  const Room hall{
      "hall", {Eigen::Vector2d(kOuter, kOuter), Eigen::Vector2d(width - kOuter, depth - kOuter)}};
  plan.AddRoom(hall);
  std::vector<Opening> windows;
  for (double x = 2; x < width - 2; x += 3.2) {
    windows.push_back(Window(x + random.Between(-0.3, 0.3), 1.6, 1.2, 3.2));
  }
  AddOuterWalls(width, depth,
                {windows, std::vector<Opening>{}, std::vector<Opening>{}, std::vector<Opening>{}},
                plan);
  Scene scene;
  scene.name = absl::StrCat("pillar hall ", seed);
  MeshBuilder builder(scene.mesh);
  plan.Build(builder);
  Furnishing furnishing(plan, random, builder);
  const int columns = 3 + static_cast<int>(random.Below(2));
  const int rows = 2 + static_cast<int>(random.Below(2));
  for (int i = 0; i < columns; ++i) {
    for (int k = 0; k < rows; ++k) {
      const double side = random.Between(0.45, 0.65);
      const Item pillar = {side, side, height};
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      const double x = width * (i + 1) / (columns + 1) + random.Between(-0.3, 0.3);
      const double y = depth * (k + 1) / (rows + 1) + random.Between(-0.3, 0.3);
      T.translate(Eigen::Vector3d(x, y, 0));
      if (!plan.PlaceThere(hall, pillar, T)) continue;
      builder.SetFrame(T);
      AddPillar(pillar, random, builder);
    }
  }
  for (int i = 0; i < 4; ++i) {
    furnishing.AtWall(
        hall, {random.Between(1.0, 1.8), random.Between(0.5, 0.9), random.Between(0.8, 2.2)},
        i % 2 == 0 ? AddShelf : AddWardrobe);
  }
  for (int i = 0; i < 8; ++i) {
    furnishing.Freely(
        hall, {random.Between(0.6, 1.2), random.Between(0.6, 1.0), random.Between(0.4, 1.1)},
        AddClutter);
  }
  for (int i = 0; i < 3; ++i) {
    furnishing.TableWithChairs(hall, {random.Between(1.4, 1.8), 0.8, 0.75}, 4);
  }
  scene.starts = StartsIn(plan);
  scene.doorways = plan.Doorways();
  scene.rooms = plan.rooms();
  // One freest place is little choice for a hall: its quarters too.
  for (const double x : {0.25, 0.75}) {
    for (const double y : {0.25, 0.75}) {
      const Eigen::Vector2d middle(x * width, y * depth);
      const Room quarter{"quarter", {middle.array() - 1.5, middle.array() + 1.5}};
      const std::optional<FloorPlan::Spot> spot = plan.FreestSpot(quarter);
      if (spot.has_value() && spot->clearance >= 0.5) {
        scene.starts.emplace_back(spot->at.x(), spot->at.y(), 1.5);
      }
    }
  }
  return scene;
}

Scene BoxRoom(const Eigen::Vector3d& size) {
  Scene scene;
  scene.name = "box room";
  MeshBuilder builder(scene.mesh);
  builder.Box(Eigen::Vector3d::Zero(), size);
  scene.starts.emplace_back(0.5 * size.x(), 0.5 * size.y(), std::min(1.5, 0.5 * size.z()));
  return scene;
}

}  // namespace vantage::simulation
