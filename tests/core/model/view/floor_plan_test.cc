// A storey from above: a room put together voxel by voxel, so that every cell is known.
#include "core/model/view/floor_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>

namespace vantage::model {
namespace {

constexpr double kVoxel = 0.05;
constexpr double kFloor = 1.0;  // m, of the storey
constexpr float kDense = 3000;
constexpr float kThin = 1000;
constexpr double kRequired = 2500;

// Puts surface into voxels.
class Builder {
 public:
  void Add(const Eigen::Vector3d& at, const Eigen::Vector3f& normal, float density,
           VoxelState state = VoxelState::kTrueSurface, bool given_up = false) {
    const VoxelIndex v = (at / kVoxel).array().floor().cast<int>();
    const VoxelIndex brick = Brick::Of(v);
    SurfaceVoxel surface;
    surface.centroid = at.cast<float>();
    surface.normal = normal;
    surface.area = static_cast<float>(kVoxel * kVoxel);
    surface.density = density;
    surface.given_up = given_up;
    bricks_[{brick.z(), brick.y(), brick.x()}][Brick::LocalOf(v)] = {state, surface};
  }
  // From 0 to the size, `at` of each voxel's centre.
  template <typename Fn>
  static void Along(double size, Fn&& fn) {
    for (int i = 0; i < std::lround(size / kVoxel); ++i) fn((i + 0.5) * kVoxel);
  }
  PlanningView Build() const {
    std::vector<BrickAt> list;
    for (const auto& [key, voxels] : bricks_) {
      auto brick = std::make_shared<Brick>();
      for (const auto& [local, of] : voxels) {  // by place, as surface is stored
        brick->state[static_cast<size_t>(local)] = of.first;
        brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
        brick->surface.push_back(of.second);
      }
      const auto& [z, y, x] = key;
      list.push_back({VoxelIndex(x, y, z), brick});
    }
    return PlanningView(kVoxel, 1, list, {});
  }

 private:
  std::map<std::tuple<int, int, int>, std::map<int, std::pair<VoxelState, SurfaceVoxel>>> bricks_;
};

// 4 x 3 m, walls on the west and south of 2.5 m, a table of 1 x 1 m and 0.7 m height at (2, 1), a
// strip of floor that is too thin from x = 3 on, a hidden patch over (1, 2), a lintel over all of
// the room at 2.1 m.
Builder Room() {
  Builder room;
  const Eigen::Vector3f up(0, 0, 1);
  Builder::Along(4, [&](double x) {
    Builder::Along(3, [&](double y) {
      room.Add({x, y, kFloor + 0.02}, up, x < 3 ? kDense : kThin);
      room.Add({x, y, kFloor + 2.1}, -up, kDense);
      if (x > 2 && x < 3 && y > 1 && y < 2) {
        room.Add({x, y, kFloor + 0.7}, up, kDense);
        room.Add({x, y, kFloor + 0.65}, up, kDense);
      }
    });
    Builder::Along(2.5, [&](double z) { room.Add({x, -0.025, kFloor + z}, {0, 1, 0}, kDense); });
  });
  Builder::Along(3, [&](double y) {
    Builder::Along(2.5, [&](double z) { room.Add({-0.025, y, kFloor + z}, {1, 0, 0}, kDense); });
  });
  for (int i = 0; i < 3; ++i) {
    room.Add({1.025, 2.025, kFloor + 0.5 + i * kVoxel}, {1, 0, 0}, 0, VoxelState::kFalseOcclusion);
  }
  return room;
}

FloorPlan Draw(const PlanningView& view, size_t most = 1'000'000) {
  return DrawFloorPlan(
      view, {kFloor, kFloor + 3},
      [](const Eigen::Vector3d&) { return std::optional<double>(kRequired); }, most);
}

size_t CellAt(const FloorPlan& plan, double x, double y) {
  return plan.At(static_cast<int>(std::floor((x - plan.corner.x()) / plan.edge)),
                 static_cast<int>(std::floor((y - plan.corner.y()) / plan.edge)));
}

TEST(FloorPlan, TellsFloorFurnitureAndWalls) {
  const FloorPlan plan = Draw(Room().Build());
  EXPECT_EQ(plan.edge, kVoxel);
  EXPECT_NEAR(plan.corner.x(), -0.05, 1e-9);
  EXPECT_NEAR(plan.corner.y(), -0.05, 1e-9);
  ASSERT_EQ(plan.columns, 81);
  ASSERT_EQ(plan.rows, 61);
  std::map<PlanCell, int> counts;
  for (const PlanCell cell : plan.cells) ++counts[cell];
  EXPECT_EQ(counts[PlanCell::kWall], 80 + 60);
  EXPECT_EQ(counts[PlanCell::kFurniture], 20 * 20);  // what is hidden stands nowhere
  EXPECT_EQ(counts[PlanCell::kThinFloor], 20 * 60);
  EXPECT_EQ(plan.cells[CellAt(plan, 0.5, 0.5)], PlanCell::kFloor);
  EXPECT_EQ(plan.cells[CellAt(plan, 3.5, 0.5)], PlanCell::kThinFloor);
  EXPECT_EQ(plan.cells[CellAt(plan, 2.5, 1.5)], PlanCell::kFurniture);
  EXPECT_EQ(plan.cells[CellAt(plan, -0.02, 1)], PlanCell::kWall);
}

TEST(FloorPlan, ShowsWhatIsMissingByKindWhereItIsRequired) {
  Builder room = Room();
  // Given up, and a voxel alone: neither is shown.
  room.Add({1.525, 2.525, kFloor + 0.5}, {1, 0, 0}, 0, VoxelState::kFalseHole, true);
  room.Add({1.525, 2.525, kFloor + 0.55}, {1, 0, 0}, 0, VoxelState::kFalseHole, true);
  room.Add({0.525, 2.525, kFloor + 0.5}, {1, 0, 0}, 0, VoxelState::kFalseImage);
  const PlanningView view = room.Build();
  const FloorPlan plan = Draw(view);
  EXPECT_EQ(plan.missing[CellAt(plan, 1.025, 2.025)], SurfaceKind::kOcclusion);
  EXPECT_EQ(plan.missing[CellAt(plan, 1.525, 2.525)], std::nullopt);
  EXPECT_EQ(plan.missing[CellAt(plan, 0.525, 2.525)], std::nullopt);
  const FloorPlan nothing_required = DrawFloorPlan(
      view, {kFloor, kFloor + 3}, [](const Eigen::Vector3d&) { return std::optional<double>(); },
      1'000'000);
  EXPECT_EQ(nothing_required.missing[CellAt(nothing_required, 1.025, 2.025)], std::nullopt);
  EXPECT_EQ(nothing_required.cells[CellAt(nothing_required, 3.5, 0.5)], PlanCell::kFloor);
}

// Walls at 20 degrees; and the extent is that of the room.
TEST(FloorPlan, FindsTheDirectionOfItsWalls) {
  EXPECT_NEAR(std::remainder(Draw(Room().Build()).direction, std::numbers::pi / 2), 0, 0.01);
  Builder turned;
  const double angle = 20 * std::numbers::pi / 180;
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
  Builder::Along(4, [&](double s) {
    Builder::Along(2, [&](double z) {
      const Eigen::Vector2d at = s * along;
      turned.Add({at.x(), at.y(), kFloor + z},
                 {static_cast<float>(-along.y()), static_cast<float>(along.x()), 0}, kDense);
    });
  });
  EXPECT_NEAR(Draw(turned.Build()).direction, angle, 0.01);
}

TEST(FloorPlan, LargeStoreysHaveLargeCells) {
  const FloorPlan plan = Draw(Room().Build(), 2000);
  EXPECT_EQ(plan.edge, 2 * kVoxel);  // 41 x 31
  EXPECT_LE(plan.cells.size(), size_t{2000});
  EXPECT_EQ(plan.cells[CellAt(plan, 0.5, 0.5)], PlanCell::kFloor);
}

TEST(FloorPlan, OfNothingIsEmpty) {
  const PlanningView view = Room().Build();
  const FloorPlan plan = DrawFloorPlan(
      view, {kFloor + 50, kFloor + 53},
      [](const Eigen::Vector3d&) { return std::optional<double>(kRequired); }, 1'000'000);
  EXPECT_EQ(plan.columns, 0);
  EXPECT_TRUE(plan.cells.empty());
  EXPECT_TRUE(plan.extent.empty());
}

}  // namespace
}  // namespace vantage::model
