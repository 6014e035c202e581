// How far a small room goes that is seen in part through its doorway, against the mesh.
#include "core/planning/expectation/room_limits.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/expectation/expectation.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

constexpr double kFarWall = 5.9;   // m, x
constexpr double kLeftWall = 3.0;  // m, y
constexpr RoomLimits kMost = {.depth = 4.5, .left = 2.5, .right = 2.5};

// A room of 4 x 4 m and a bath of 1.8 x 2.2 m behind a doorway in the wall x = 4, around both of
// them nothing but walls.
simulation::TriangleMesh TwoRoomsOneSmall(bool cupboard) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  const auto box = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    builder.Box({x0, y0, z0}, {x1, y1, z1});
  };
  box(-0.2, 6.1, -0.2, 4.2, -0.2, 0);
  box(-0.2, 6.1, -0.2, 4.2, 2.5, 2.7);
  box(-0.2, 0, -0.2, 4.2, 0, 2.5);
  box(0, 6.1, -0.2, 0, 0, 2.5);
  box(0, 6.1, 4, 4.2, 0, 2.5);
  box(4, 4.1, 0, 1.5, 0, 2.5);
  box(4, 4.1, 2.4, 4, 0, 2.5);
  box(4, 4.1, 1.5, 2.4, 2.05, 2.5);
  box(4.1, 6.1, 0, 0.8, 0, 2.5);
  box(4.1, 6.1, kLeftWall, 4, 0, 2.5);
  box(kFarWall, 6.1, 0.8, kLeftWall, 0, 2.5);
  if (cupboard) box(5.4, 5.9, 2.4, 2.7, 0, 2.2);
  return mesh;
}

class RoomLimitsTest : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.2);
    const simulation::SimulatedScanner tracer{mesh_};
    model_ = model::PartialModel::Create({}).value();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(Eigen::Vector3d(1.5, 1.2, 1.6));
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer.Scan(scanner_, pose, simulation::ScanFaults{}, 1, pool_);
    ASSERT_TRUE(model_->Insert("scan", scan, pose, pool_).ok());
    view_ = model_->Publish();
    config_.station_basis = StationBasis::kExpected;
    problem_ = PlanningProblem::Prepare({*view_, scanner_, config_}, pool_).value();
    ASSERT_EQ(problem_->openings().openings.size(), 1u);
  }
  const Opening& doorway() const { return problem_->openings().openings.front(); }

  const simulation::TriangleMesh mesh_ = TwoRoomsOneSmall(GetParam());
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  std::shared_ptr<const PlanningProblem> problem_;
};

TEST_P(RoomLimitsTest, AreThoseOfTheWallsThatWereSeen) {
  const RoomLimits limits = LimitsBehind(*view_, doorway(), kMost);
  const double voxel = view_->voxel_size();
  EXPECT_NEAR(limits.depth, kFarWall - doorway().centre.x(), voxel);
  EXPECT_NEAR(limits.left, kLeftWall - doorway().centre.y(), voxel);
  EXPECT_EQ(limits.right, kMost.right) << "no scan saw that wall";
}

TEST_P(RoomLimitsTest, AreThoseAskedForWhereWallsAreFarther) {
  const RoomLimits near = {.depth = 1.0, .left = 0.8, .right = 0.6};
  const RoomLimits limits = LimitsBehind(*view_, doorway(), near);
  EXPECT_EQ(limits.depth, near.depth);
  EXPECT_EQ(limits.left, near.left);
  EXPECT_EQ(limits.right, near.right);
}

// A third of the far wall was seen: the room does not go on beside that.
TEST_P(RoomLimitsTest, NothingIsExpectedBehindAWallThatWasSeenInPart) {
  ASSERT_NE(problem_->expectation(), nullptr);
  const Expectation& expectation = *problem_->expectation();
  const double voxel = view_->voxel_size();
  const model::VoxelBox& box = expectation.view().bounds();
  size_t expected = 0;
  for (int z = box.min.z(); z < box.max.z(); ++z) {
    for (int y = box.min.y(); y < box.max.y(); ++y) {
      for (int x = box.min.x(); x < box.max.x(); ++x) {
        const model::VoxelIndex v(x, y, z);
        if (!expectation.view().Empty(v) || !expectation.Expected(v)) continue;
        ++expected;
        const Eigen::Vector3d centre = view_->Centre(v);
        ASSERT_LT(centre.x(), kFarWall + voxel);
        ASSERT_LT(centre.y(), kLeftWall + voxel);
      }
    }
  }
  EXPECT_GT(expected, 1000u);
}

// Two rooms behind the wall x = 4, and what the scanner sees through the farther door of the wall
// between them: its other side.
TEST(RoomLimitsOfNeighboursTest, AWallThatWasSeenFromItsOtherSideEndsTheRoom) {
  constexpr double kOtherSide = 2.3;  // m, y
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  const auto box = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    builder.Box({x0, y0, z0}, {x1, y1, z1});
  };
  box(-0.2, 7.2, -0.2, 5.2, -0.2, 0);
  box(-0.2, 7.2, -0.2, 5.2, 2.5, 2.7);
  box(-0.2, 0, -0.2, 5.2, 0, 2.5);
  box(0, 7.2, -0.2, 0, 0, 2.5);
  box(0, 7.2, 5, 5.2, 0, 2.5);
  box(7, 7.2, 0, 5, 0, 2.5);
  box(4, 4.1, 0, 0.3, 0, 2.5);
  box(4, 4.1, 1.2, 2.7, 0, 2.5);
  box(4, 4.1, 3.6, 5, 0, 2.5);
  box(4, 4.1, 0.3, 1.2, 2.05, 2.5);
  box(4, 4.1, 2.7, 3.6, 2.05, 2.5);
  box(4.1, 7, 2.2, kOtherSide, 0, 2.5);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.2);
  const simulation::SimulatedScanner tracer{mesh};
  parallel::ThreadPool pool(2);
  const auto model = model::PartialModel::Create({}).value();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(2.5, 3.9, 1.6));
  sensor::Scan scan;
  scan.scanner = scanner;
  scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, 1, pool);
  ASSERT_TRUE(model->Insert("scan", scan, pose, pool).ok());
  const std::shared_ptr<const model::PlanningView> view = model->Publish();
  Opening near;
  near.centre = Eigen::Vector3d(4.05, 0.75, 0);
  near.direction = Eigen::Vector3d::UnitX();
  near.width = 0.9;
  near.head = 2.05;
  const RoomLimits limits = LimitsBehind(*view, near, kMost);
  EXPECT_GT(limits.left, kOtherSide - 0.1 - near.centre.y() - view->voxel_size());
  EXPECT_LT(limits.left, kOtherSide - near.centre.y());
  EXPECT_EQ(limits.right, kMost.right) << "no scan saw that wall";
}

// Doorways in the wall y = 0, into rooms of their own, by where their middles are along it.
Openings DoorsInOneWall(const std::vector<double>& places) {
  Openings openings;
  openings.spaces.push_back({0, true, 10, 1});
  for (const double x : places) {
    Opening door;
    door.centre = Eigen::Vector3d(x, 0, 0);
    door.direction = Eigen::Vector3d::UnitY();
    door.width = 0.9;
    door.head = 2;
    door.floor_through = door.lintel = true;
    door.behind = static_cast<int>(openings.spaces.size());
    openings.spaces.push_back({0, false, 1, 2});
    openings.openings.push_back(door);
  }
  return openings;
}

TEST(EndedBetweenDoorwaysTest, AWallStandsHalfWayToTheNextDoorway) {
  const Openings doors = DoorsInOneWall({0, 3, 9});
  const RoomLimits middle = EndedBetweenDoorways(doors, 1, kMost);
  EXPECT_EQ(middle.depth, kMost.depth);
  // Who walks in along +y has x = 0 to his left.
  EXPECT_NEAR(middle.left, 1.5, 1e-12);
  EXPECT_EQ(middle.right, kMost.right) << "the next doorway is farther than a room is wide";
}

TEST(EndedBetweenDoorwaysTest, ADoorwayKeepsItsOwnWidth) {
  const Openings doors = DoorsInOneWall({0, 1.0});
  EXPECT_GE(EndedBetweenDoorways(doors, 0, kMost).right, 0.45);
}

// A leaf divides what is behind a doorway, or a room behind it was entered: then it is found twice.
TEST(EndedBetweenDoorwaysTest, ADoorwayThatIsFoundTwiceEndsNothing) {
  Openings doors = DoorsInOneWall({0, 0.05});
  EXPECT_EQ(EndedBetweenDoorways(doors, 0, kMost).right, kMost.right);
  EXPECT_EQ(EndedBetweenDoorways(doors, 1, kMost).left, kMost.left);
  doors.openings[1].centre = doors.openings[0].centre;
  doors.openings[1].direction = -Eigen::Vector3d::UnitY();
  EXPECT_EQ(EndedBetweenDoorways(doors, 0, kMost).right, kMost.right);
  EXPECT_EQ(EndedBetweenDoorways(doors, 0, kMost).left, kMost.left);
}

TEST(EndedBetweenDoorwaysTest, OtherWallsStoreysWindowsAndTheSameRoomEndNothing) {
  const Openings doors = DoorsInOneWall({0, 3});
  const auto ends = [](const Openings& changed) {
    return EndedBetweenDoorways(changed, 0, kMost).right < kMost.right;
  };
  ASSERT_TRUE(ends(doors));
  Openings other = doors;
  other.openings[1].centre.y() = 2;
  EXPECT_FALSE(ends(other)) << "the corridor's other wall";
  other = doors;
  other.openings[1].direction = Eigen::Vector3d::UnitX();
  EXPECT_FALSE(ends(other));
  other = doors;
  other.openings[1].storey = 1;
  EXPECT_FALSE(ends(other));
  other = doors;
  other.openings[1].floor_through = false;
  EXPECT_FALSE(ends(other));
  other = doors;
  other.openings[1].behind = other.openings[0].behind;
  EXPECT_FALSE(ends(other));
  // Into the corridor, seen from a room that was entered.
  other = doors;
  other.openings[1].direction = -Eigen::Vector3d::UnitY();
  EXPECT_TRUE(ends(other));
}

INSTANTIATE_TEST_SUITE_P(Bath, RoomLimitsTest, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "WithACupboard" : "Bare"; });

}  // namespace
}  // namespace vantage::planning
