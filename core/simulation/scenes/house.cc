#include "core/simulation/scenes/house.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/simulation/scenes/furnishing.h"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kFacadeWall = 0.25;  // m
constexpr double kRoomWall = 0.12;
constexpr double kHousePassage = 0.37;
constexpr double kClearHeight = 2.6;                         // m, floor to ceiling
constexpr double kFloorSlab = 0.2;                           // m
constexpr double kStoreyHeight = kClearHeight + kFloorSlab;  // m, floor to floor
constexpr int kRisersOfFlight = 8;
constexpr double kRise = kStoreyHeight / (2 * kRisersOfFlight);  // 0.175 m
constexpr double kGoing = 0.28;                                  // m
constexpr double kFlight = (kRisersOfFlight - 1) * kGoing;       // m, in plan
constexpr double kParapet = 1.0;                                 // m over the floor
constexpr double kThin = 0.08;                                   // m, of parapets

// What all storeys share, in plan, m.
struct HousePlan {
  double width;  // x, outside of the facades
  double depth;  // y
  double west;   // axes of the walls along the hall
  double east;
  double foot;  // y at which the stairs begin: beyond it the upper storeys are open

  double hall_low() const { return west + 0.5 * kRoomWall; }   // x
  double hall_high() const { return east - 0.5 * kRoomWall; }  // x
  double middle() const { return 0.5 * (west + east); }        // x, between the flights
  double back() const { return depth - kFacadeWall; }          // y, of the landing's end
  Eigen::AlignedBox2d Stairwell() const {
    return {Eigen::Vector2d(hall_low(), foot), Eigen::Vector2d(hall_high(), back())};
  }
};

// Two flights from this storey's floor to the next one's: up along y in the west half, over a
// landing, and back in the east half.
void AddFlights(const HousePlan& plan, MeshBuilder& builder) {
  constexpr double kThick = 0.25;  // m, of a step and what carries it
  const double landing = plan.foot + kFlight;
  for (int k = 1; k < kRisersOfFlight; ++k) {
    const double top = k * kRise;
    builder.Box({plan.hall_low(), plan.foot + (k - 1) * kGoing, std::max(0.0, top - kThick)},
                {plan.middle() - 0.5 * kThin, plan.foot + k * kGoing, top});
    const double upper = (kRisersOfFlight + k) * kRise;
    builder.Box({plan.middle() + 0.5 * kThin, landing - k * kGoing, upper - kThick},
                {plan.hall_high(), landing - (k - 1) * kGoing, upper});
  }
  const double half_way = kRisersOfFlight * kRise;
  builder.Box({plan.hall_low(), landing, half_way - kFloorSlab},
              {plan.hall_high(), plan.back(), half_way});
}

// The edges of the slab below a storey, around the stairwell.
void AddSlabEdges(const HousePlan& plan, MeshBuilder& builder) {
  const Eigen::AlignedBox2d well = plan.Stairwell();
  const auto edge = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    builder.Quad({Vector3d(a.x(), a.y(), -kFloorSlab), Vector3d(b.x(), b.y(), -kFloorSlab),
                  Vector3d(b.x(), b.y(), 0), Vector3d(a.x(), a.y(), 0)});
  };
  const Eigen::Vector2d& low = well.min();
  const Eigen::Vector2d& high = well.max();
  edge({low.x(), low.y()}, {high.x(), low.y()});
  edge({high.x(), low.y()}, {high.x(), high.y()});
  edge({high.x(), high.y()}, {low.x(), high.y()});
  edge({low.x(), high.y()}, {low.x(), low.y()});
}

// A storey with rooms, its floor at z = 0.
TriangleMesh Storey(const HousePlan& house, bool ground, RandomSequence& random,
                    std::vector<Vector3d>& starts) {
  FloorPlan plan({Eigen::Vector2d(0, 0), Eigen::Vector2d(house.width, house.depth)}, kClearHeight,
                 kHousePassage);
  if (!ground) plan.OpenFloor(house.Stairwell());
  plan.OpenCeiling(house.Stairwell());
  const double half = 0.5 * kRoomWall;
  // The walls between the two rooms on either side; the doors of the back rooms lead to the hall
  // before the stairs.
  const double split_west = random.Between(2.4, house.foot - 1.5);
  const double split_east = random.Between(2.4, house.foot - 1.5);
  const auto inside = [](double x0, double y0, double x1, double y1) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1));
  };
  const double west = house.west - half;
  const double east = house.east + half;
  const double far = house.width - kFacadeWall;
  const Room hall{"hall",
                  inside(house.hall_low(), kFacadeWall, house.hall_high(), house.foot - 0.9)};
  const std::array<Room, 4> rooms = {
      Room{"south-west", inside(kFacadeWall, kFacadeWall, west, split_west - half)},
      Room{"north-west", inside(kFacadeWall, split_west + half, west, house.back())},
      Room{"south-east", inside(east, kFacadeWall, far, split_east - half)},
      Room{"north-east", inside(east, split_east + half, far, house.back())}};
  plan.AddRoom(hall);
  for (const Room& room : rooms) plan.AddRoom(room);

  const double axis = 0.5 * kFacadeWall;
  Wall south{{0, axis}, {house.width, axis}, kFacadeWall, {}};
  south.openings.push_back(Window(random.Between(1.6, 2.6), 1.4, 0.9, 2.2));
  south.openings.push_back(
      Window(random.Between(house.width - 2.6, house.width - 1.6), 1.4, 0.9, 2.2));
  Wall north{{0, house.depth - axis}, {house.width, house.depth - axis}, kFacadeWall, {}};
  north.openings.push_back(Window(random.Between(1.6, 2.6), 1.6, 0.9, 2.2));
  north.openings.push_back(
      Window(random.Between(house.width - 2.6, house.width - 1.6), 1.6, 0.9, 2.2));
  Wall side_west{{axis, 0}, {axis, house.depth}, kFacadeWall, {}};
  side_west.openings.push_back(Window(random.Between(5.0, house.depth - 1.4), 1.2, 0.9, 2.2));
  Wall side_east{{house.width - axis, 0}, {house.width - axis, house.depth}, kFacadeWall, {}};
  side_east.openings.push_back(Window(random.Between(5.0, house.depth - 1.4), 1.2, 0.9, 2.2));
  for (const Wall& wall : {south, north, side_west, side_east}) plan.AddWall(wall);
  Wall along_west{{house.west, axis}, {house.west, house.depth - axis}, kRoomWall, {}};
  Wall along_east{{house.east, axis}, {house.east, house.depth - axis}, kRoomWall, {}};
  const auto door = [&](Wall& wall, double y, const Room& into) {
    wall.openings.push_back(Doorway(wall, y - axis, into.inside.center(), random));
  };
  door(along_west, random.Between(1.2, split_west - 0.9), rooms[0]);
  door(along_west, random.Between(split_west + 0.7, house.foot - 0.6), rooms[1]);
  door(along_east, random.Between(1.2, split_east - 0.9), rooms[2]);
  door(along_east, random.Between(split_east + 0.7, house.foot - 0.6), rooms[3]);
  plan.AddWall(along_west);
  plan.AddWall(along_east);
  plan.AddWall({{axis, split_west}, {house.west, split_west}, kRoomWall, {}});
  plan.AddWall({{house.east, split_east}, {far, split_east}, kRoomWall, {}});

  TriangleMesh mesh;
  MeshBuilder builder(mesh);
  plan.Build(builder);
  if (!ground) AddSlabEdges(house, builder);
  AddFlights(house, builder);
  Furnishing furnishing(plan, random, builder);
  if (ground) {
    furnishing.Study(rooms[0]);
    furnishing.Living(rooms[1]);
    furnishing.Bath(rooms[2]);
    furnishing.Study(rooms[3]);
  } else {
    furnishing.Bath(rooms[0]);
    furnishing.Bedroom(rooms[1]);
    furnishing.ChildsRoom(rooms[2]);
    furnishing.Bedroom(rooms[3]);
  }
  furnishing.CeilingLamps(hall, 4);
  starts = StartsIn(plan);
  return mesh;
}

// The attic, its floor at z = 0: knee walls to the west and east, gables, a ridge along y.
TriangleMesh Attic(const HousePlan& house, RandomSequence& random, std::vector<Vector3d>& starts) {
  const double knee = random.Between(1.0, 1.3);
  const double ridge = random.Between(3.3, 3.7);
  const double middle = 0.5 * house.width;
  const double slope = (ridge - knee) / middle;
  const auto roof = [&](double x) { return ridge - slope * std::abs(x - middle); };
  TriangleMesh mesh;
  MeshBuilder builder(mesh);
  const Eigen::AlignedBox2d well = house.Stairwell();
  const auto floor = [&](double x0, double y0, double x1, double y1) {
    builder.Quad(
        {Vector3d(x0, y0, 0), Vector3d(x1, y0, 0), Vector3d(x1, y1, 0), Vector3d(x0, y1, 0)});
  };
  floor(0, 0, house.width, well.min().y());
  floor(0, well.min().y(), well.min().x(), house.depth);
  floor(well.max().x(), well.min().y(), house.width, house.depth);
  AddSlabEdges(house, builder);
  // The shaft's last wall, below the gable, and the knee walls.
  builder.Box({0, 0, 0}, {kFacadeWall, house.depth, roof(kFacadeWall)});
  builder.Box({house.width - kFacadeWall, 0, 0}, {house.width, house.depth, roof(kFacadeWall)});
  for (const double y : {kFacadeWall, house.back()}) {
    builder.Quad({Vector3d(0, y, 0), Vector3d(middle, y, 0), Vector3d(middle, y, ridge),
                  Vector3d(0, y, knee)});
    builder.Quad({Vector3d(middle, y, 0), Vector3d(house.width, y, 0),
                  Vector3d(house.width, y, knee), Vector3d(middle, y, ridge)});
  }
  builder.Quad({Vector3d(0, 0, knee), Vector3d(middle, 0, ridge),
                Vector3d(middle, house.depth, ridge), Vector3d(0, house.depth, knee)});
  builder.Quad({Vector3d(middle, 0, ridge), Vector3d(house.width, 0, knee),
                Vector3d(house.width, house.depth, knee), Vector3d(middle, house.depth, ridge)});
  // Nobody goes up further: a parapet where the next flight would begin, and along the well.
  builder.Box({well.min().x() - kThin, well.min().y() - kThin, 0},
              {house.middle(), well.min().y(), kParapet});
  builder.Box({well.min().x() - kThin, well.min().y(), 0},
              {well.min().x(), well.max().y(), kParapet});
  builder.Box({well.max().x(), well.min().y(), 0},
              {well.max().x() + kThin, well.max().y(), kParapet});
  // Chimney, posts below the purlins, and what people put into attics.
  const double chimney_x = random.Between(1.8, house.west - 1.2);
  const double chimney_y = random.Between(2.0, house.depth - 2.5);
  builder.Box({chimney_x, chimney_y, 0}, {chimney_x + 0.6, chimney_y + 0.5, roof(chimney_x)});
  for (const double x : {house.west - 0.9, house.east + 0.9}) {
    for (const double y : {1.6, house.depth - 1.6}) {
      builder.Box({x - 0.07, y - 0.07, 0}, {x + 0.07, y + 0.07, roof(x) - 0.05});
    }
  }
  for (int k = 0; k < 8; ++k) {
    const bool west = random.Chance(0.5);
    const double width = random.Between(0.4, 1.2);
    const double height = random.Between(0.3, 0.9);
    const double away = random.Between(0.05, 0.8);  // from the knee wall
    const double y = random.Between(0.6, house.depth - 2.0);
    const double x = west ? kFacadeWall + away : house.width - kFacadeWall - away - width;
    builder.Box({x, y, 0}, {x + width, y + random.Between(0.3, 1.0), height});
  }
  starts = {{middle, 0.5 * house.foot, 1.5}};
  return mesh;
}

// Adds `storey`, lifted by `height` (m).
void Append(const TriangleMesh& storey, double height, TriangleMesh& mesh) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : storey.vertices) {
    mesh.vertices.emplace_back(vertex + Eigen::Vector3f(0, 0, static_cast<float>(height)));
  }
  for (const std::array<uint32_t, 3>& t : storey.triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  mesh.material.insert(mesh.material.end(), storey.material.begin(), storey.material.end());
}

}  // namespace

Scene HouseOfThreeStoreys(uint64_t seed) {
  RandomSequence random(MixBits(seed) ^ 3);
  HousePlan house{};
  house.width = random.Between(10.4, 11.4);
  house.depth = random.Between(7.9, 8.5);
  const double hall = random.Between(2.35, 2.55);
  house.west = 0.5 * (house.width - hall) + random.Between(-0.4, 0.4);
  house.east = house.west + hall;
  // The landing is 1.1 to 1.2 m deep.
  house.foot = house.back() - kFlight - random.Between(1.1, 1.2);
  Scene scene;
  scene.name = absl::StrCat("house ", seed);
  scene.several_levels = true;
  constexpr int kStoreys = 3;
  for (int storey = 0; storey < kStoreys; ++storey) {
    std::vector<Vector3d> starts;
    const TriangleMesh mesh = storey + 1 < kStoreys ? Storey(house, storey == 0, random, starts)
                                                    : Attic(house, random, starts);
    const double height = storey * kStoreyHeight;
    Append(mesh, height, scene.mesh);
    for (const Vector3d& start : starts) {
      scene.starts.emplace_back(start + height * Vector3d::UnitZ());
    }
  }
  return scene;
}

}  // namespace vantage::simulation
