#include "core/simulation/scenes/furnished_flat.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/simulation/scenes/furnishing.h"

namespace vantage::simulation {
namespace {

constexpr double kOuter = 0.2;   // m, wall thickness
constexpr double kInner = 0.12;  // m
constexpr double kPassage = 0.37;

Eigen::AlignedBox2d Box(double x0, double y0, double x1, double y1) {
  return {Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1)};
}

}  // namespace

// Living room and bedroom to the south, a hall across, bath and one or two rooms to the north; the
// plan may be mirrored in both directions.
Scene FurnishedFlat(uint64_t seed) {
  RandomSequence random(seed);
  const double width = random.Between(11.6, 12.4);
  const double depth = random.Between(9.0, 9.5);
  const double south = random.Between(4.5, 4.9);            // wall between south rooms and hall
  const double north = south + random.Between(1.55, 1.75);  // wall between hall and north rooms
  const double middle = random.Between(6.3, 6.9);           // wall between living room and bedroom
  const double bath = random.Between(2.6, 3.1);             // wall between bath and its neighbour
  const double child = random.Between(6.8, 7.6);            // wall between the two north rooms
  const bool six_rooms = random.Chance(0.6);
  const bool mirror_x = random.Chance(0.5);
  const bool mirror_y = random.Chance(0.5);

  const auto at = [&](double x, double y) {
    return Eigen::Vector2d(mirror_x ? width - x : x, mirror_y ? depth - y : y);
  };
  const auto inside = [&](double x0, double y0, double x1, double y1) {
    Eigen::AlignedBox2d box;
    box.extend(at(x0, y0));
    box.extend(at(x1, y1));
    return box;
  };
  FloorPlan plan(Box(0, 0, width, depth), random.Between(2.6, 2.8), kPassage);
  const double half = 0.5 * kInner;
  const Room living{"living room", inside(kOuter, kOuter, middle - half, south - half)};
  const Room bedroom{"bedroom", inside(middle + half, kOuter, width - kOuter, south - half)};
  const Room hall{"hall", inside(kOuter, south + half, width - kOuter, north - half)};
  const Room bathroom{"bath", inside(kOuter, north + half, bath - half, depth - kOuter)};
  const Room second{
      six_rooms ? "child's room" : "study",
      inside(bath + half, north + half, six_rooms ? child - half : width - kOuter, depth - kOuter)};
  const Room third{"study", inside(child + half, north + half, width - kOuter, depth - kOuter)};
  for (const Room& room : {living, bedroom, hall, bathroom, second}) plan.AddRoom(room);
  if (six_rooms) plan.AddRoom(third);

  const auto wall = [&](double x0, double y0, double x1, double y1, double thickness) {
    return Wall{at(x0, y0), at(x1, y1), thickness, {}};
  };
  const auto door = [&](Wall& where, double along, const Room& into) {
    where.openings.push_back(Doorway(where, along, into.inside.center(), random));
  };

  // Outer walls with windows; corners overlap.
  const double edge = 0.5 * kOuter;
  Wall south_wall = wall(0, edge, width, edge, kOuter);
  south_wall.openings.push_back(Window(random.Between(1.8, 2.4), 1.8, 0.1, 2.2));
  south_wall.openings.push_back(Window(random.Between(4.4, 4.9), 1.4, 0.9, 2.2));
  south_wall.openings.push_back(Window(random.Between(9.0, 9.8), 1.6, 0.9, 2.2));
  plan.AddWall(south_wall);
  Wall north_wall = wall(0, depth - edge, width, depth - edge, kOuter);
  north_wall.openings.push_back(Window(random.Between(1.2, 1.6), 0.7, 1.4, 2.2));
  north_wall.openings.push_back(Window(random.Between(4.4, 5.2), 1.4, 0.9, 2.2));
  north_wall.openings.push_back(Window(random.Between(9.2, 9.9), 1.4, 0.9, 2.2));
  plan.AddWall(north_wall);
  Wall west_wall = wall(edge, 0, edge, depth, kOuter);
  west_wall.openings.push_back(Window(random.Between(2.0, 2.8), 1.2, 0.9, 2.2));
  plan.AddWall(west_wall);
  Wall east_wall = wall(width - edge, 0, width - edge, depth, kOuter);
  east_wall.openings.push_back(Window(random.Between(2.0, 2.8), 1.2, 0.9, 2.2));
  plan.AddWall(east_wall);

  // Inner walls end inside the walls they meet.
  Wall hall_south = wall(edge, south, width - edge, south, kInner);
  if (random.Chance(0.4)) {
    Opening wide;  // without a door
    wide.middle = random.Between(2.0, 3.0);
    wide.width = random.Between(1.3, 1.6);
    wide.head = 2.2;
    hall_south.openings.push_back(wide);
  } else {
    door(hall_south, random.Between(1.6, 3.4), living);
  }
  door(hall_south, random.Between(middle + 1.3, width - 2.2), bedroom);
  plan.AddWall(hall_south);
  Wall hall_north = wall(edge, north, width - edge, north, kInner);
  door(hall_north, random.Between(1.1, bath - 1.1), bathroom);
  door(hall_north, random.Between(bath + 1.2, 6.0), second);
  if (six_rooms) door(hall_north, random.Between(child + 1.2, width - 2.2), third);
  plan.AddWall(hall_north);
  Wall between_south = wall(middle, edge, middle, south, kInner);
  if (random.Chance(0.4)) door(between_south, random.Between(1.6, 3.0), bedroom);
  plan.AddWall(between_south);
  plan.AddWall(wall(bath, north, bath, depth - edge, kInner));
  if (six_rooms) plan.AddWall(wall(child, north, child, depth - edge, kInner));

  Scene scene;
  scene.name = absl::StrCat("furnished flat ", seed);
  MeshBuilder builder(scene.mesh);
  plan.Build(builder);
  Furnishing furnishing(plan, random, builder);
  furnishing.Living(living);
  furnishing.Bedroom(bedroom);
  furnishing.Bath(bathroom);
  furnishing.Hall(hall);
  if (six_rooms) {
    furnishing.ChildsRoom(second);
    furnishing.Study(third);
  } else {
    furnishing.Study(second);
  }
  scene.starts = StartsIn(plan);
  scene.doorways = plan.Doorways();
  scene.rooms = plan.rooms();
  return scene;
}

}  // namespace vantage::simulation
