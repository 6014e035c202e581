#include "core/simulation/scenes/large_hall.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "core/simulation/scenes/furnishing.h"

namespace vantage::simulation {
namespace {

constexpr double kLength = 100;        // m
constexpr double kDepth = 60;          // m
constexpr double kHallHeight = 15;     // m
constexpr double kCladding = 0.3;      // m, thickness of the outer walls
constexpr double kDividing = 0.2;      // m
constexpr double kSideRooms = 6;       // m, of the rooms along one side
constexpr double kHallPassage = 0.37;  // m: through the door of 0.95 m
constexpr double kGrid = 12.5;         // m from column to column

}  // namespace

Scene LargeHall(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 5);
  FloorPlan plan({Eigen::Vector2d(0, 0), Eigen::Vector2d(kLength, kDepth)}, kHallHeight,
                 kHallPassage);
  const double beside = kDepth - kCladding - kSideRooms - 0.5 * kDividing;  // the dividing wall
  const Room hall{"hall",
                  {Eigen::Vector2d(kCladding, kCladding),
                   Eigen::Vector2d(kLength - kCladding, beside - 0.5 * kDividing)}};
  plan.AddRoom(hall);

  const std::vector<double> ends = {kCladding - 0.5 * kDividing, random.Between(28, 36),
                                    random.Between(62, 70), kLength - kCladding + 0.5 * kDividing};
  Wall dividing{{0.5 * kCladding, beside}, {kLength - 0.5 * kCladding, beside}, kDividing, {}};
  std::vector<Room> rooms;
  for (size_t i = 0; i + 1 < ends.size(); ++i) {
    rooms.push_back({absl::StrCat("room ", i + 1),
                     {Eigen::Vector2d(ends[i] + 0.5 * kDividing, beside + 0.5 * kDividing),
                      Eigen::Vector2d(ends[i + 1] - 0.5 * kDividing, kDepth - kCladding)}});
    plan.AddRoom(rooms.back());
    Opening opening;
    opening.middle = random.Between(ends[i] + 6, ends[i + 1] - 6) - 0.5 * kCladding;
    if (i != 1) {  // a gate; the room in the middle has a door
      opening.width = random.Between(3, 4);
      opening.head = random.Between(3.5, 4.5);
    }
    dividing.openings.push_back(opening);
    if (i > 0)
      plan.AddWall({{ends[i], beside}, {ends[i], kDepth - 0.5 * kCladding}, kDividing, {}});
  }
  plan.AddWall(dividing);
  const double e = 0.5 * kCladding;
  plan.AddWall({{0, e}, {kLength, e}, kCladding, {}});
  plan.AddWall({{kLength - e, 0}, {kLength - e, kDepth}, kCladding, {}});
  plan.AddWall({{kLength, kDepth - e}, {0, kDepth - e}, kCladding, {}});
  plan.AddWall({{e, kDepth}, {e, 0}, kCladding, {}});

  Scene scene;
  scene.name = absl::StrCat("large hall ", seed);
  MeshBuilder builder(scene.mesh);
  plan.Build(builder);
  for (double x = kGrid; x < kLength - 1; x += kGrid) {
    for (double y = kGrid; y < beside - 1; y += kGrid) {
      const double side = random.Between(0.5, 0.7);
      const Item column = {side, side, kHallHeight};
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.translate(Eigen::Vector3d(x + random.Between(-0.2, 0.2), y + random.Between(-0.2, 0.2), 0));
      if (!plan.PlaceThere(hall, column, T)) continue;
      builder.SetFrame(T);
      AddPillar(column, random, builder);
    }
  }
  Furnishing furnishing(plan, random, builder);
  for (int i = 0; i < 12; ++i) {
    furnishing.AtWall(hall, {random.Between(3, 8), 1.2, random.Between(2, 6)}, AddShelf);
  }
  for (int i = 0; i < 24; ++i) {
    furnishing.Freely(
        hall, {random.Between(0.8, 2.5), random.Between(0.8, 2.0), random.Between(0.5, 2.5)},
        AddClutter);
  }
  // The middle of the hall, where the first scan sees most of it, then where its parts are freest.
  const auto add = [&](const Eigen::Vector2d& middle) {
    const Room part{"part", {middle.array() - 3.0, middle.array() + 3.0}};
    const std::optional<FloorPlan::Spot> spot = plan.FreestSpot(part);
    if (spot.has_value() && spot->clearance >= 0.5) {
      scene.starts.emplace_back(spot->at.x(), spot->at.y(), 1.5);
    }
  };
  add({0.5 * kLength, 0.5 * beside});
  for (const double x : {0.125, 0.375, 0.625, 0.875}) {
    for (const double y : {0.25, 0.75}) add({x * kLength, y * beside});
  }
  for (const Eigen::Vector3d& start : StartsIn(plan)) {
    if (start.y() > beside) scene.starts.push_back(start);
  }
  return scene;
}

}  // namespace vantage::simulation
