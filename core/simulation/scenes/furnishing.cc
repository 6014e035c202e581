#include "core/simulation/scenes/furnishing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage::simulation {
namespace {

constexpr Item kChair = {0.44, 0.46, 0.9};
constexpr double kStartHeight = 1.5;     // m
constexpr double kStartClearance = 0.5;  // m

}  // namespace

bool Furnishing::AtWall(const Room& room, const Item& item, AddFunction add) {
  const std::optional<Eigen::Isometry3d> T = plan_.PlaceAtWall(room, item, random_);
  if (!T.has_value()) return false;
  builder_.SetFrame(*T);
  add(item, random_, builder_);
  return true;
}

bool Furnishing::Freely(const Room& room, const Item& item, AddFunction add) {
  const std::optional<Eigen::Isometry3d> T = plan_.PlaceFreely(room, item, std::nullopt, random_);
  if (!T.has_value()) return false;
  builder_.SetFrame(*T);
  add(item, random_, builder_);
  return true;
}

void Furnishing::Chair(const Room& room, const Eigen::Isometry3d& T_scene_table, double x,
                       double depth, bool in_front) {
  const double gap = random_.Between(0.02, 0.2);
  const double askew = random_.Between(-0.35, 0.35);
  const double y = in_front ? depth + gap + kChair.depth : -gap - kChair.depth;
  const Eigen::Isometry3d T =
      T_scene_table * Eigen::Translation3d(x, y, 0) *
      Eigen::AngleAxisd((in_front ? std::numbers::pi : 0) + askew, Eigen::Vector3d::UnitZ());
  if (!plan_.PlaceThere(room, kChair, T)) return;
  builder_.SetFrame(T);
  AddChair(kChair, random_, builder_);
}

bool Furnishing::TableWithChairs(const Room& room, const Item& table, int chairs) {
  // Along the room, or a little askew.
  const Eigen::Vector2d size = room.inside.sizes();
  const double yaw = (size.x() >= size.y() ? 0 : std::numbers::pi / 2) + random_.Between(-0.2, 0.2);
  const std::optional<Eigen::Isometry3d> T = plan_.PlaceFreely(room, table, yaw, random_);
  if (!T.has_value()) return false;
  builder_.SetFrame(*T);
  AddTable(table, random_, builder_);
  const int per_side = std::max(1, chairs / 2);
  for (int i = 0; i < per_side; ++i) {
    const double x = table.width * ((i + 0.5) / per_side - 0.5);
    Chair(room, *T, x, table.depth, true);
    Chair(room, *T, x, table.depth, false);
  }
  return true;
}

bool Furnishing::DeskWithChair(const Room& room) {
  const Item desk = {random_.Between(1.2, 1.6), random_.Between(0.65, 0.8), 0.74};
  const std::optional<Eigen::Isometry3d> T = plan_.PlaceAtWall(room, desk, random_);
  if (!T.has_value()) return false;
  builder_.SetFrame(*T);
  AddDesk(desk, random_, builder_);
  Chair(room, *T, random_.Between(-0.3, 0.1), desk.depth, true);
  return true;
}

void Furnishing::CeilingLamps(const Room& room, double spacing) {
  const Eigen::Vector2d size = room.inside.sizes();
  const int columns = std::max(1, static_cast<int>(size.x() / spacing));
  const int rows = std::max(1, static_cast<int>(size.y() / spacing));
  for (int i = 0; i < columns; ++i) {
    for (int k = 0; k < rows; ++k) {
      const Eigen::Vector2d at = room.inside.min() + Eigen::Vector2d((i + 0.5) * size.x() / columns,
                                                                     (k + 0.5) * size.y() / rows);
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.translation() = Eigen::Vector3d(at.x(), at.y(), 0);
      builder_.SetFrame(T);
      AddCeilingLamp(plan_.height(), random_, builder_);
    }
  }
}

void Furnishing::Living(const Room& room) {
  AtWall(room, {random_.Between(2.6, 3.2), 0.62, 2.1}, AddKitchen);
  AtWall(room, {random_.Between(1.9, 2.2), 0.9, 0.8}, AddSofa);
  AtWall(room, {random_.Between(1.4, 1.7), 0.42, 1.2}, AddSideboard);
  TableWithChairs(room, {random_.Between(1.4, 1.7), random_.Between(0.8, 0.9), 0.75}, 4);
  AtWall(room, {random_.Between(0.8, 1.2), 0.3, random_.Between(1.8, 2.1)}, AddShelf);
  AtWall(room, {random_.Between(0.8, 1.0), 0.3, random_.Between(1.2, 1.9)}, AddShelf);
  Freely(room, {random_.Between(0.8, 1.0), 0.55, 0.42}, AddTable);
  AtWall(room, {0.55, 0.55, random_.Between(1.2, 1.6)}, AddPlant);
  AtWall(room, {0.4, 0.4, 1.6}, AddFloorLamp);
  AtWall(room, {0.4, 0.35, 0.5}, AddClutter);
  CeilingLamps(room, 3.2);
}

void Furnishing::Bedroom(const Room& room) {
  AtWall(room, {random_.Between(1.5, 1.8), 2.08, random_.Between(0.8, 1.0)}, AddBed);
  AtWall(room, {random_.Between(1.6, 2.2), 0.6, 2.15}, AddWardrobe);
  AtWall(room, {random_.Between(0.9, 1.1), 0.45, 1.75}, AddDresser);
  if (random_.Chance(0.6)) DeskWithChair(room);
  AtWall(room, {0.45, 0.4, 0.55}, AddClutter);
  AtWall(room, {random_.Between(0.7, 1.0), 0.3, random_.Between(0.9, 1.9)}, AddShelf);
  AtWall(room, {0.5, 0.5, 1.3}, AddPlant);
  CeilingLamps(room, 5);
}

void Furnishing::ChildsRoom(const Room& room) {
  AtWall(room, {0.95, 2.05, 0.75}, AddBed);
  DeskWithChair(room);
  AtWall(room, {random_.Between(0.9, 1.2), 0.55, 1.9}, AddWardrobe);
  AtWall(room, {random_.Between(0.7, 0.9), 0.3, random_.Between(1.0, 1.6)}, AddShelf);
  for (int i = 0; i < 2; ++i) Freely(room, {0.35, 0.3, 0.35}, AddClutter);
  CeilingLamps(room, 5);
}

void Furnishing::Study(const Room& room) {
  DeskWithChair(room);
  AtWall(room, {random_.Between(0.9, 1.3), 0.3, random_.Between(1.9, 2.2)}, AddShelf);
  AtWall(room, {random_.Between(0.9, 1.3), 0.3, random_.Between(1.9, 2.2)}, AddShelf);
  AtWall(room, {1.6, 0.85, 0.8}, AddSofa);
  AtWall(room, {0.5, 0.5, 1.4}, AddPlant);
  AtWall(room, {0.45, 0.4, 0.6}, AddClutter);
  CeilingLamps(room, 5);
}

void Furnishing::Bath(const Room& room) {
  AtWall(room, {random_.Between(0.7, 0.9), 0.48, 2.0}, AddWashstand);
  AtWall(room, {1.65, 0.75, 0.57}, AddBathtub);
  AtWall(room, {0.4, 0.65, 0.8}, AddToilet);
  if (random_.Chance(0.7)) AtWall(room, {0.6, 0.58, 0.85}, AddWardrobe);
  AtWall(room, {0.35, 0.3, 0.5}, AddClutter);
  CeilingLamps(room, 5);
}

void Furnishing::Hall(const Room& room) {
  AtWall(room, {random_.Between(0.8, 1.1), 0.32, random_.Between(0.9, 1.9)}, AddShelf);
  AtWall(room, {random_.Between(0.8, 1.2), 0.38, 1.9}, AddWardrobe);
  AtWall(room, {0.35, 0.3, 0.4}, AddClutter);
  AtWall(room, {0.8, 0.34, 1.75}, AddDresser);
  CeilingLamps(room, 4);
}

void Furnishing::Office(const Room& room) {
  const int desks = std::clamp(static_cast<int>(room.inside.volume() / 7), 1, 6);
  for (int i = 0; i < desks; ++i) DeskWithChair(room);
  AtWall(room, {random_.Between(0.9, 1.3), 0.35, random_.Between(1.8, 2.1)}, AddShelf);
  AtWall(room, {random_.Between(0.9, 1.3), 0.45, random_.Between(1.2, 2.0)}, AddWardrobe);
  AtWall(room, {0.5, 0.5, 1.4}, AddPlant);
  AtWall(room, {0.4, 0.35, 0.5}, AddClutter);
  CeilingLamps(room, 3);
}

void Furnishing::MeetingRoom(const Room& room) {
  const Eigen::Vector2d size = room.inside.sizes();
  const double length = std::clamp(size.maxCoeff() - 2.6, 1.4, 3.2);
  TableWithChairs(room, {length, random_.Between(0.9, 1.2), 0.75}, static_cast<int>(length / 0.4));
  AtWall(room, {1.5, 0.42, 1.2}, AddSideboard);
  AtWall(room, {0.5, 0.5, 1.5}, AddPlant);
  CeilingLamps(room, 3);
}

void Furnishing::Corridor(const Room& room) {
  const int pieces = 1 + static_cast<int>(room.inside.sizes().maxCoeff() / 8);
  for (int i = 0; i < pieces; ++i) {
    AtWall(room, {random_.Between(0.8, 1.2), 0.4, random_.Between(1.0, 1.9)}, AddWardrobe);
    AtWall(room, {0.45, 0.45, 1.4}, AddPlant);
  }
  CeilingLamps(room, 4);
}

Opening Doorway(const Wall& wall, double middle, const Eigen::Vector2d& into,
                RandomSequence& random) {
  Opening opening;
  opening.middle = middle;
  if (random.Chance(0.6)) {
    const Eigen::Vector2d along = (wall.to - wall.from).normalized();
    const Eigen::Vector2d left(-along.y(), along.x());
    opening.leaf_angle = random.Between(1.55, 1.8);
    opening.leaf_at_end = random.Chance(0.5);
    opening.leaf_to_left = left.dot(into - wall.from) > 0;
  }
  return opening;
}

Opening Window(double middle, double width, double sill, double head) {
  Opening opening;
  opening.middle = middle;
  opening.width = width;
  opening.sill = sill;
  opening.head = head;
  opening.window = true;
  return opening;
}

std::vector<Eigen::Vector3d> StartsIn(const FloorPlan& plan) {
  std::vector<Eigen::Vector3d> starts;
  for (const Room& room : plan.rooms()) {
    const std::optional<FloorPlan::Spot> spot = plan.FreestSpot(room);
    if (!spot.has_value() || spot->clearance < kStartClearance) continue;
    starts.emplace_back(spot->at.x(), spot->at.y(), kStartHeight);
  }
  return starts;
}

}  // namespace vantage::simulation
