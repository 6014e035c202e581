#include "core/simulation/scenes/office_storey.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/simulation/scenes/furnishing.h"

namespace vantage::simulation {
namespace {

constexpr double kFacade = 0.3;  // m, wall thickness
constexpr double kPartition = 0.12;
constexpr double kOfficePassage = 0.37;
constexpr double kRoomDepth = 5.2;  // m, wall to wall
constexpr double kCorridor = 2.2;
constexpr double kBand = 2 * kRoomDepth + kCorridor;  // rooms, corridor, rooms
constexpr double kLongest = 42;                       // m; longer storeys get more bands

// The walls between the rooms of one row, ascending, the first and last being its ends.
std::vector<double> DivideRow(double from, double to, RandomSequence& random) {
  std::vector<double> walls = {from};
  while (to - walls.back() > 6.5) {
    walls.push_back(walls.back() + std::min(random.Between(3.0, 6.0), to - walls.back() - 3.0));
  }
  walls.push_back(to);
  return walls;
}

}  // namespace

// One or more bands of rooms along a corridor, one above the other; a cross corridor at the low end
// joins them.
Scene OfficeStorey(uint64_t seed, double area_m2) {
  RandomSequence random(MixBits(seed) ^ 4);
  const double area = std::clamp(area_m2, 100.0, 5000.0);
  const int bands = std::max(1, static_cast<int>(std::ceil(area / (kBand * kLongest))));
  const double depth = bands * kBand;
  const double length = std::max(8.0, area / depth);
  const double begin = bands > 1 ? kCorridor : 0.5 * kFacade;  // where the rows begin
  const double end = length - 0.5 * kFacade;
  const double half = 0.5 * kPartition;
  FloorPlan plan({Eigen::Vector2d(0, 0), Eigen::Vector2d(length, depth)}, 2.8, kOfficePassage);

  std::vector<Room> corridors;
  std::vector<Room> offices;
  std::vector<Wall> walls;
  Wall south{{0, 0.5 * kFacade}, {length, 0.5 * kFacade}, kFacade, {}};
  Wall north{{0, depth - 0.5 * kFacade}, {length, depth - 0.5 * kFacade}, kFacade, {}};
  for (int band = 0; band < bands; ++band) {
    const double base = band * kBand;
    const std::array<double, 2> corridor_walls = {base + kRoomDepth, base + kRoomDepth + kCorridor};
    corridors.push_back(
        {"corridor",
         {Eigen::Vector2d(bands > 1 ? begin + half : kFacade, corridor_walls[0] + half),
          Eigen::Vector2d(length - kFacade, corridor_walls[1] - half)}});
    for (const bool upper : {false, true}) {
      const bool at_facade = upper ? band == bands - 1 : band == 0;
      const double low = upper ? corridor_walls[1] + half : base + (at_facade ? kFacade : half);
      const double high =
          upper ? base + kBand - (at_facade ? kFacade : half) : corridor_walls[0] - half;
      Wall to_corridor{{begin, corridor_walls[upper ? 1 : 0]},
                       {end, corridor_walls[upper ? 1 : 0]},
                       kPartition,
                       {}};
      const std::vector<double> divisions = DivideRow(begin, end, random);
      for (size_t i = 0; i + 1 < divisions.size(); ++i) {
        const double left = i == 0 && bands == 1 ? kFacade : divisions[i] + half;
        const double right = i + 2 == divisions.size() ? length - kFacade : divisions[i + 1] - half;
        const Room room{random.Chance(0.2) ? "meeting room" : "office",
                        {Eigen::Vector2d(left, low), Eigen::Vector2d(right, high)}};
        const double door = random.Between(left + 0.9, right - 0.9);
        to_corridor.openings.push_back(
            Doorway(to_corridor, door - begin, room.inside.center(), random));
        // A pane to the corridor beside the door, where there is space for it.
        const double left_space = door - 0.8 - left;
        if (room.name == "meeting room" && left_space > 1.2) {
          to_corridor.openings.push_back(
              Window(left + 0.5 * left_space - begin, left_space - 0.5, 0.9, 2.1));
        }
        if (at_facade) {
          const double width = std::min(2.4, right - left - 0.8);
          (upper ? north : south).openings.push_back(Window(0.5 * (left + right), width, 0.9, 2.3));
        }
        if (i > 0) {
          const double wall_low = upper ? corridor_walls[1] : base;
          const double wall_high = upper ? base + kBand : corridor_walls[0];
          walls.push_back({{divisions[i], wall_low}, {divisions[i], wall_high}, kPartition, {}});
        }
        offices.push_back(room);
      }
      walls.push_back(to_corridor);
    }
    if (band > 0) walls.push_back({{begin, base}, {end, base}, kPartition, {}});
  }
  Wall west{{0.5 * kFacade, 0}, {0.5 * kFacade, depth}, kFacade, {}};
  Wall east{{length - 0.5 * kFacade, 0}, {length - 0.5 * kFacade, depth}, kFacade, {}};
  for (int band = 0; band < bands; ++band) {
    east.openings.push_back(Window(band * kBand + kRoomDepth + 0.5 * kCorridor, 1.2, 0.9, 2.3));
  }
  for (const Wall& wall : {south, north, west, east}) walls.push_back(wall);
  if (bands > 1) {
    const Room cross{
        "corridor",
        {Eigen::Vector2d(kFacade, kFacade), Eigen::Vector2d(begin - half, depth - kFacade)}};
    corridors.push_back(cross);
    Wall side{{begin, 0.5 * kFacade}, {begin, depth - 0.5 * kFacade}, kPartition, {}};
    for (int band = 0; band < bands; ++band) {
      Opening open;  // without a door, up to the ceiling
      open.middle = band * kBand + kRoomDepth + 0.5 * kCorridor - 0.5 * kFacade;
      open.width = kCorridor - kPartition;
      open.head = plan.height();
      side.openings.push_back(open);
    }
    walls.push_back(side);
  }
  for (const Room& room : corridors) plan.AddRoom(room);
  for (const Room& room : offices) plan.AddRoom(room);
  for (const Wall& wall : walls) plan.AddWall(wall);

  Scene scene;
  scene.name = absl::StrCat("office storey ", seed, ", ", std::lround(area), " m2");
  MeshBuilder builder(scene.mesh);
  plan.Build(builder);
  Furnishing furnishing(plan, random, builder);
  for (const Room& room : offices) {
    if (room.name == "office") furnishing.Office(room);
    if (room.name == "meeting room") furnishing.MeetingRoom(room);
  }
  for (const Room& room : corridors) furnishing.Corridor(room);
  scene.starts = StartsIn(plan);
  scene.doorways = plan.Doorways();
  scene.rooms = plan.rooms();
  return scene;
}

}  // namespace vantage::simulation
