#include "core/planning/feasibility/feasible_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <set>
#include <tuple>
#include <utility>

#include "core/parallel/parallel.h"
#include "core/parallel/thread_pool.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

// Cell by cell from the definitions of algorithm.md section 7A, for a level floor that the test
// knows: no rows of bits, no octree, no distance transform.
class SlowFeasible {
 public:
  // `floor`: z of what was measured of the floor, m.
  SlowFeasible(const model::PlanningView& model, double floor, const sensor::ScannerModel& scanner,
               const PlanningConfig& config)
      : model_(model), floor_(floor), scanner_(scanner), config_(config) {}

  bool Cell(const Eigen::Vector3i& cell) const {
    const double size = config_.viewcell_size;
    const Eigen::Vector3d low = cell.cast<double>() * size;
    const Eigen::Vector3d high = low.array() + size;
    if (low.z() < floor_ + config_.min_viewpoint_height - 1e-9 ||
        high.z() > floor_ + config_.max_viewpoint_height + 1e-9)
      return false;
    const double h = model_.voxel_size();
    const int n = static_cast<int>(std::lround(size / h));
    for (int z = FirstLayer(); z < (cell.z() + 1) * n; ++z) {
      for (int y = cell.y() * n; y < (cell.y() + 1) * n; ++y) {
        for (int x = cell.x() * n; x < (cell.x() + 1) * n; ++x) {
          if (!model_.Empty({x, y, z})) return false;
        }
      }
    }
    for (const Region& box : config_.keep_out) {
      if ((low.array() < box.max().array() - 1e-9).all() &&
          (high.array() > box.min().array() + 1e-9).all()) {
        return false;
      }
    }
    const Region own(low, high);
    for (const RejectedPlace& place : config_.rejected) {
      const Eigen::Vector3d at(place.position.x(), place.position.y(), low.z());
      if (own.exteriorDistance(at) < place.radius) return false;
    }
    const int reach = static_cast<int>(std::ceil(scanner_.clearance / h)) + 1;
    for (int z = cell.z() * n - reach; z < (cell.z() + 1) * n + reach; ++z) {
      for (int y = cell.y() * n - reach; y < (cell.y() + 1) * n + reach; ++y) {
        for (int x = cell.x() * n - reach; x < (cell.x() + 1) * n + reach; ++x) {
          if (model_.Empty({x, y, z})) continue;
          const Region voxel(Eigen::Vector3d(x, y, z) * h,
                             Eigen::Vector3d(x + 1, y + 1, z + 1) * h);
          if (own.exteriorDistance(voxel) < scanner_.clearance - 1e-6) return false;
        }
      }
    }
    return true;
  }

  // Columns to which the upright cylinder can move from the station.
  std::set<std::pair<int, int>> Reached() const {
    const double size = config_.viewcell_size;
    std::set<std::pair<int, int>> reached;
    std::deque<std::pair<int, int>> queue;
    for (const model::Station& station : model_.stations()) {
      const std::pair<int, int> at(static_cast<int>(std::floor(station.position.x() / size)),
                                   static_cast<int>(std::floor(station.position.y() / size)));
      reached.insert(at);
      queue.push_back(at);
    }
    while (!queue.empty()) {
      const auto [x, y] = queue.front();
      queue.pop_front();
      for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
          if (reached.count({i, j}) == 0 && Fits((i + 0.5) * size, (j + 0.5) * size)) {
            reached.insert({i, j});
            queue.emplace_back(i, j);
          }
        }
      }
    }
    return reached;
  }

 private:
  // One layer over the floor's own may still hold some of it.
  int FirstLayer() const { return static_cast<int>(std::floor(floor_ / model_.voxel_size())) + 2; }

  bool Fits(double px, double py) const {
    const double h = model_.voxel_size();
    const double radius = config_.scanner_width / 2;
    for (int y = static_cast<int>((py - radius) / h) - 1; y <= (py + radius) / h + 1; ++y) {
      for (int x = static_cast<int>((px - radius) / h) - 1; x <= (px + radius) / h + 1; ++x) {
        const Eigen::AlignedBox2d column(Eigen::Vector2d(x, y) * h,
                                         Eigen::Vector2d(x + 1, y + 1) * h);
        if (column.exteriorDistance(Eigen::Vector2d(px, py)) >= radius - 1e-9) continue;
        for (int z = FirstLayer(); z * h < floor_ + config_.scanner_height - 1e-6; ++z) {
          const model::VoxelState state = model_.State({x, y, z});
          const bool measured =
              state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
          const bool hanging =
              (z - FirstLayer()) * h >= 0.5 - 1e-9;  // over what was empty all the way
          if (state != model::VoxelState::kEmpty && (measured || !hanging)) return false;
        }
      }
    }
    return true;
  }

  const model::PlanningView& model_;
  double floor_;
  const sensor::ScannerModel& scanner_;
  const PlanningConfig& config_;
};

class FeasibleViewsTest : public ::testing::TestWithParam<int> {
 protected:
  FeasibleViews Find(const model::PlanningView& model) {
    return FeasibleViews::Find(model, visibility::OpaqueGrid(model), scanner_, config_, pool_)
        .value();
  }
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::ThreadPool pool_{2};
};

TEST_P(FeasibleViewsTest, EqualsTheDefinitionInEveryCell) {
  const auto seed = static_cast<uint64_t>(GetParam());
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(seed));
  config_.keep_out = {Region(Eigen::Vector3d(2.03, 3.1, 0), Eigen::Vector3d(2.6, 3.71, 3))};
  config_.rejected = {{Eigen::Vector3d(3.2, 1.3, 1.5), 0.45}};
  config_.require_reachable = seed % 2 == 0;
  if (seed % 3 == 0) scanner_.clearance = 0.21;
  const FeasibleViews views = Find(model);
  // The floor is at z = 0, and the voxels that hold it have their middle half a voxel below.
  const SlowFeasible slow(model, -0.025, scanner_, config_);
  const auto reached = slow.Reached();
  size_t feasible = 0;
  for (int z = -2; z < 30; ++z) {
    for (int y = -3; y < 54; ++y) {
      for (int x = -3; x < 64; ++x) {
        const bool expected =
            slow.Cell({x, y, z}) && (!config_.require_reachable || reached.count({x, y}) > 0);
        ASSERT_EQ(views.IndexOf({x, y, z}) >= 0, expected)
            << "seed " << seed << ", cell " << x << " " << y << " " << z << ": "
            << InfeasibilityWords(views.Why({x, y, z}), scanner_, config_);
        feasible += expected;
      }
    }
  }
  EXPECT_EQ(feasible, views.cells().size());
  EXPECT_GT(feasible, 500u);
}
INSTANTIATE_TEST_SUITE_P(Seeds, FeasibleViewsTest, ::testing::Range(1, 9));

// Where it is given, nothing is measured.
TEST_F(FeasibleViewsTest, AGivenFloorIsWhereItIsSaidToBe) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(1));
  config_.viewcell_size = 0.05;
  const size_t found = Find(model).cells().size();
  for (const double given : {-0.025, 0.175}) {
    SCOPED_TRACE(given);
    config_.floor_z = given;
    const FeasibleViews views = Find(model);
    ASSERT_FALSE(views.cells().empty());
    double lowest = 10;
    double highest = 0;
    for (const FeasibleViews::CellIndex& cell : views.cells()) {
      lowest = std::min(lowest, 0.05 * cell.z());
      highest = std::max(highest, 0.05 * (cell.z() + 1));
    }
    EXPECT_NEAR(lowest, given + config_.min_viewpoint_height, 0.05);
    EXPECT_NEAR(highest, given + config_.max_viewpoint_height, 0.05);
    EXPECT_EQ(views.cells().size() == found, given < 0);
  }
}

TEST_F(FeasibleViewsTest, FindsFloorAndNotTables) {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(1);
  const auto room = scene.solid;
  const Region table(Eigen::Vector3d(2, 3, 0.7), Eigen::Vector3d(4, 4.5, 0.75));
  scene.solid = [=](const Eigen::Vector3d& p) { return room(p) || table.contains(p); };
  const model::PlanningView model = test_support::BuildView(scene);
  const FloorMap floor = FloorMap::Find(model, std::nullopt).value();
  ASSERT_TRUE(floor.found());
  int floors = 0;
  for (int y = 1; y < 99; ++y) {
    for (int x = 1; x < 80; ++x) {
      for (const Floor& here : floor.columns().At(x, y)) {
        ASSERT_LT(std::abs(here.height), 0.06) << x << " " << y;
        ++floors;
      }
      const bool boxed = room(Eigen::Vector3d((x + 0.5) * 0.05, (y + 0.5) * 0.05, 0.03));
      ASSERT_TRUE(boxed || floor.columns().At(x, y).size() == 1) << x << " " << y;
    }
  }
  EXPECT_GT(floors, 6000);
}

TEST_F(FeasibleViewsTest, StationIsFeasibleAboveItsBlindConeAndConnected) {
  // One scan sees nothing below 60 degrees: the cone under it is unknown, but for the cylinder.
  test_support::ClosedFormScene scene;
  const Region room(Eigen::Vector3d::Zero(), Eigen::Vector3d(5, 4, 2.6));
  const Eigen::Vector3d station(2.02, 2.03, 1.51);
  scene.extent = Region(room.min().array() - 0.1, room.max().array() + 0.1);
  scene.solid = [=](const Eigen::Vector3d& p) { return !room.contains(p); };
  scene.known = [=](const Eigen::Vector3d& p) {
    const double away = (p - station).head<2>().norm();
    return away < 0.4 || station.z() - p.z() < away * std::tan(sensor::Radians(60));
  };
  scene.false_kind = [](const Eigen::Vector3d&) { return model::VoxelState::kFalseImage; };
  scene.stations = {test_support::MakeStation(station)};
  const model::PlanningView model = test_support::BuildView(scene);
  const FeasibleViews views = Find(model);
  EXPECT_GE(views.IndexOf(views.CellOf(station)), 0)
      << InfeasibilityWords(views.Why(views.CellOf(station)), scanner_, config_);
  // Between the cylinder and the rim of the cone the floor is not known to be free.
  EXPECT_EQ(views.Why(views.CellOf(station + Eigen::Vector3d(0.6, 0, 0))),
            Infeasibility::kAboveObject);
  // Beyond the cone it is, and the cone does not cut it off.
  EXPECT_GE(views.IndexOf(views.CellOf({4, 3, 1.5})), 0);
  EXPECT_NEAR(*views.reach().Travel({4.05, 3.05, 1.5}),
              (Eigen::Vector2d(4.05, 3.05) - station.head<2>()).norm(), 0.25);
}

TEST_F(FeasibleViewsTest, DoorTooNarrowCutsOff) {
  for (const double door : {0.5, 0.9}) {
    test_support::ClosedFormScene scene;
    const Region room(Eigen::Vector3d::Zero(), Eigen::Vector3d(6, 4, 2.6));
    scene.extent = Region(room.min().array() - 0.1, room.max().array() + 0.1);
    scene.solid = [=](const Eigen::Vector3d& p) {
      return !room.contains(p) || (std::abs(p.x() - 3) < 0.1 && std::abs(p.y() - 2) > door / 2);
    };
    scene.stations = {test_support::MakeStation(Eigen::Vector3d(1.5, 2, 1.5))};
    const model::PlanningView model = test_support::BuildView(scene);
    const FeasibleViews views = Find(model);
    EXPECT_GE(views.IndexOf(views.CellOf({1.05, 1.05, 1.55})), 0);
    EXPECT_EQ(views.IndexOf(views.CellOf({4.55, 2.05, 1.55})) >= 0, door > 0.6) << door;
    if (door < 0.6) {
      EXPECT_EQ(views.Why(views.CellOf({4.55, 2.05, 1.55})), Infeasibility::kUnreachable);
      EXPECT_FALSE(views.reach().Travel({4.55, 2.05, 1.5}).has_value());
    }
  }
}

// Rays through a doorway to a window on its other side never come back: at their height the doorway
// is not known, and people walk through it.
TEST_F(FeasibleViewsTest, WhatHangsUnknownInTheAirDoesNotBlockTheWay) {
  for (const auto& [bottom, measured, passes] :
       {std::tuple{0.8, false, true}, {0.3, false, false}, {0.8, true, false}}) {
    SCOPED_TRACE(::testing::Message() << "from " << bottom << " m, measured " << measured);
    test_support::ClosedFormScene scene;
    const Region room(Eigen::Vector3d::Zero(), Eigen::Vector3d(6, 4, 2.6));
    const Region block(Eigen::Vector3d(2.8, 1.5, bottom), Eigen::Vector3d(3.2, 2.5, 2.2));
    scene.extent = Region(room.min().array() - 0.1, room.max().array() + 0.1);
    scene.solid = [=, solid = measured](const Eigen::Vector3d& p) {
      return !room.contains(p) || (std::abs(p.x() - 3) < 0.1 && std::abs(p.y() - 2) > 0.45) ||
             (solid && block.contains(p));
    };
    scene.known = [=, hidden = !measured](const Eigen::Vector3d& p) {
      return !(hidden && block.contains(p));
    };
    scene.false_kind = [](const Eigen::Vector3d&) { return model::VoxelState::kFalseHole; };
    scene.stations = {test_support::MakeStation(Eigen::Vector3d(1.5, 2, 1.5))};
    const FeasibleViews views = Find(test_support::BuildView(scene));
    EXPECT_EQ(views.IndexOf(views.CellOf({4.5, 2, 1.5})) >= 0, passes);
    // To stand in it is another matter.
    EXPECT_LT(views.IndexOf(views.CellOf({3, 2, 1.5})), 0);
  }
}

TEST_F(FeasibleViewsTest, EmptyModelHasNone) {
  const model::PlanningView model(0.05, 1, {}, {});
  const FeasibleViews views = Find(model);
  EXPECT_TRUE(views.cells().empty());
  EXPECT_FALSE(views.floor().found());
}

TEST_F(FeasibleViewsTest, ClearanceIsTheDistanceToTheNearestVoxel) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(2));
  const visibility::OpaqueGrid grid(model);
  EXPECT_NEAR(ClearanceAt(grid, 0.05, {0.3, 2, 1.2}, 2), 0.3, 1e-9);
  EXPECT_NEAR(ClearanceAt(grid, 0.05, {1.5, 1.5, 0.42}, 2), 0.42, 1e-9);
  EXPECT_EQ(ClearanceAt(grid, 0.05, {1.5, 1.5, 1.3}, 0.2), 0.2);
  EXPECT_EQ(ClearanceAt(grid, 0.05, {-5, 0, 0}, 2), 0);
}

}  // namespace
}  // namespace vantage::planning
