// Nobody is sent into the air, and every storey has its views: against a brute force that knows the
// mesh (algorithm.md section 7A).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "tests/support/standing_oracle.h"

namespace vantage::planning {
namespace {

constexpr double kRecall = 0.95;

class EdgesTest : public ::testing::Test {
 protected:
  EdgesTest() { scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4); }

  FeasibleViews Find(const model::PlanningView& model) {
    return FeasibleViews::Find(model, visibility::OpaqueGrid(model), scanner_, config_, pool_)
        .value();
  }
  void ExpectOnTheFloor(const simulation::Scene& scene) {
    const auto model = test_support::ScanFromStarts(scene, scanner_, pool_);
    const FeasibleViews views = Find(*model);
    const test_support::StandingFigures figures =
        test_support::JudgeStanding(scene, *model, views, scanner_, config_);
    std::printf("%s: %zu views, %zu in the air; recall %zu of %zu\n", scene.name.c_str(),
                figures.feasible, figures.in_air, figures.found, figures.allowed);
    EXPECT_EQ(figures.in_air, 0u);
    for (const Eigen::Vector3d& p : figures.air) ADD_FAILURE() << "in the air: " << p.transpose();
    EXPECT_GE(figures.recall(), kRecall);
    for (const Eigen::Vector3d& p : figures.missed) {
      std::printf("  missed (%.2f, %.2f, %.2f): %s\n", p.x(), p.y(), p.z(),
                  InfeasibilityWords(views.Why(views.CellOf(p)), scanner_, config_).c_str());
    }
    EXPECT_GT(figures.allowed, 20u);
  }

  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::ThreadPool pool_{2};
};

class EdgeSceneTest : public EdgesTest, public ::testing::WithParamInterface<size_t> {};

TEST_P(EdgeSceneTest, ViewsStandOnTheFloor) {
  ExpectOnTheFloor(simulation::EdgeScenes()[GetParam()]);
}
INSTANTIATE_TEST_SUITE_P(Edges, EdgeSceneTest, ::testing::Range(size_t{0}, size_t{12}),
                         [](const auto& scene) {
                           std::string name = simulation::EdgeScenes()[scene.param].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

const simulation::Scene& SceneNamed(const std::vector<simulation::Scene>& scenes,
                                    const std::string& name) {
  return *std::find_if(scenes.begin(), scenes.end(),
                       [&](const simulation::Scene& scene) { return scene.name == name; });
}

TEST_F(EdgesTest, EachStoreyHasViewsOfItsOwn) {
  const std::vector<simulation::Scene> scenes = simulation::EdgeScenes();
  for (const char* name : {"two storeys", "atrium", "house"}) {
    SCOPED_TRACE(name);
    const FeasibleViews views =
        Find(*test_support::ScanFromStarts(SceneNamed(scenes, name), scanner_, pool_));
    ASSERT_EQ(views.floor().storeys().count(), 2u);
    std::array<size_t, 2> count{};
    for (size_t i = 0; i < views.cells().size(); ++i) {
      const Eigen::Vector3d view = views.Centre(i);
      const double floor = view.z() - views.HeightOverFloor(view);
      if (std::abs(floor) < 0.05 || std::abs(floor - 2.8) < 0.05) {  // not on the stairs
        ASSERT_EQ(*views.Storey(view), floor > 1 ? 1 : 0) << view.transpose();
      }
      ASSERT_GE(views.HeightOverFloor(view), config_.min_viewpoint_height - 0.05);
      ASSERT_LE(views.HeightOverFloor(view), config_.max_viewpoint_height + 0.05);
      ++count[static_cast<size_t>(*views.Storey(view))];
    }
    EXPECT_GT(count[0], 300u);
    EXPECT_GT(count[1], 300u);
    // From the last station, which is upstairs, down: by the stairs where there are some.
    EXPECT_EQ(views.reach().Travel({0.75, 4.05, 1.55}).has_value(), std::string(name) == "house");
  }
}

TEST_F(EdgesTest, APlaceIsRejectedOnItsOwnStorey) {
  const auto model = test_support::ScanFromStarts(
      SceneNamed(simulation::EdgeScenes(), "two storeys"), scanner_, pool_);
  const Eigen::Vector3d below(5.05, 3.55, 1.55);
  const Eigen::Vector3d above = below + Eigen::Vector3d(0, 0, 2.8);
  const FeasibleViews all = Find(*model);
  ASSERT_GE(all.IndexOf(all.CellOf(below)), 0);
  ASSERT_GE(all.IndexOf(all.CellOf(above)), 0);
  config_.rejected = {{above, 0.5}};
  const FeasibleViews views = Find(*model);
  EXPECT_GE(views.IndexOf(views.CellOf(below)), 0);
  EXPECT_EQ(views.Why(views.CellOf(above)), Infeasibility::kRejected);
}

TEST_F(EdgesTest, StairsAreWalked) {
  const std::vector<simulation::Scene> scenes = simulation::EdgeScenes();
  simulation::Scene house = SceneNamed(scenes, "house");
  for (const bool up : {false, true}) {
    if (up) std::reverse(house.starts.begin(), house.starts.end());
    const FeasibleViews views = Find(*test_support::ScanFromStarts(house, scanner_, pool_));
    const ReachMap& reach = views.reach();
    const auto first = reach.Travel(house.starts[1]);
    const auto whole = reach.Travel(house.starts[0]);
    ASSERT_TRUE(first.has_value());
    ASSERT_TRUE(whole.has_value());
    // Seen from above: straight to the landing; and around the end of the wall between the flights.
    EXPECT_GT(*first, 3.87);
    EXPECT_LT(*first, 4.7);
    EXPECT_GT(*whole, 6.0);
    EXPECT_LT(*whole, 8.5);
  }
}

// A hall 2 m wide, and a landing `steps` steps over it and `deep` m deep that a flight leads up to
// along y; without treads where `edge`: then only the drop.
struct Flight {
  static constexpr double kRise = 0.175;
  static constexpr double kGoing = 0.28;
  static constexpr double kFoot = 3.0;  // m, y

  Flight(int steps, double deep, bool edge)
      : top(kFoot + (steps - 1) * kGoing), floor(steps * kRise) {
    scene.name = "hall with a flight of stairs";
    simulation::MeshBuilder builder(scene.mesh);
    const auto box = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
      builder.Box({x0, y0, z0}, {x1, y1, z1});
    };
    box(-0.2, 2.2, -0.2, top, -0.2, 0);
    for (int k = 1; k < steps && !edge; ++k) {
      box(0.5, 1.5, kFoot + (k - 1) * kGoing, kFoot + k * kGoing, 0, k * kRise);
    }
    box(-0.2, 2.2, top, top + deep + 0.2, -0.2, floor);
    box(-0.2, 2.2, -0.2, top + deep + 0.2, 4.2, 4.4);
    box(-0.2, 0, -0.2, top + deep + 0.2, 0, 4.2);
    box(2, 2.2, -0.2, top + deep + 0.2, 0, 4.2);
    box(0, 2, -0.2, 0, 0, 4.2);
    box(0, 2, top + deep, top + deep + 0.2, 0, 4.2);
  }
  // m away from the edge of the landing, and over it.
  Eigen::Vector3d OnLanding(double away, double height) const {
    return {1, top + away, floor + height};
  }

  simulation::Scene scene;
  double top;    // y of the landing's edge, m
  double floor;  // z of the landing, m
};

const Eigen::Vector3d kInHall(1, 1.5, 1.5);

// Who stands on stairs sees more of the halls at their foot and head than of the steps around,
// which lie in the blind cone: the model takes a hall's floor for the scanner's own, and what is
// over it for empty. What other scans measured under the tripod says better.
TEST_F(EdgesTest, AScannerOnTheStairsDoesNotCutThemInTwo) {
  Flight flight(8, 2, false);
  const Eigen::Vector3d head = flight.OnLanding(0.4, 1.3);
  // Of the fifth and its neighbours neither scan measures a sample.
  for (const int step : {2, 3, 4}) {
    for (const double height : {1.1, 1.8}) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", " << height << " m over it");
      const double y = Flight::kFoot + (step - 0.5) * Flight::kGoing;
      flight.scene.starts = {head, {1, y, step * Flight::kRise + height}};
      const FeasibleViews views =
          Find(*test_support::ScanFromStarts(flight.scene, scanner_, pool_));
      EXPECT_TRUE(views.reach().Travel(head).has_value()) << "up";
      const auto down = views.reach().Travel(kInHall);
      EXPECT_TRUE(down.has_value()) << "down";
      if (!down.has_value()) continue;
      EXPECT_GT(*down, y - kInHall.y() - 0.2);
      EXPECT_LT(*down, y - kInHall.y() + 0.5);
    }
  }
}

// The steps right below a tripod at the head of stairs are seen by nobody before somebody has
// walked them. That they are there is told by those that go on beyond.
TEST_F(EdgesTest, AScannerAtTheHeadOfStairsDoesNotHideThem) {
  for (const double away : {0.35, 0.5, 0.8}) {
    for (const double height : {1.15, 1.5}) {
      SCOPED_TRACE(testing::Message() << away << " m from the edge, " << height << " m over it");
      Flight flight(8, 2, false);
      flight.scene.starts = {flight.OnLanding(away, height)};
      const FeasibleViews views =
          Find(*test_support::ScanFromStarts(flight.scene, scanner_, pool_));
      EXPECT_TRUE(views.reach().Travel(kInHall).has_value());
    }
  }
}

// A drop of two to five steps' height is no stairs, whatever the blind cone hides at its foot. The
// landing is deep, so that the model takes its floor for the scanner's own, not the hall's.
TEST_F(EdgesTest, ADropBelowATripodIsNoStairs) {
  for (const int steps : {2, 3, 4, 5}) {
    for (const double away : {0.35, 0.5, 0.8}) {
      SCOPED_TRACE(testing::Message() << away << " m from the edge, " << steps << " steps high");
      Flight drop(steps, 5, true);
      drop.scene.starts = {drop.OnLanding(away, 1.5)};
      const FeasibleViews views = Find(*test_support::ScanFromStarts(drop.scene, scanner_, pool_));
      EXPECT_TRUE(views.floor().columns().Near(20, 30, 0.0f, 0.1) != nullptr) << "its foot is seen";
      EXPECT_FALSE(views.reach().Travel(kInHall).has_value());
    }
  }
}

class RandomEdgesTest : public EdgesTest, public ::testing::WithParamInterface<int> {};

TEST_P(RandomEdgesTest, ViewsStandOnTheFloor) {
  ExpectOnTheFloor(simulation::RandomEdgeScene(static_cast<uint64_t>(GetParam())));
}
// The last ones: a corner of three steps; a pit behind glass; a station among plinths; a step in a
// shadow, crossed at two heights; a station on a plinth.
INSTANTIATE_TEST_SUITE_P(Seeds, RandomEdgesTest,
                         ::testing::Values(1, 2, 3, 4, 5, 6, 7, 8, 17, 31, 178, 852, 967));

}  // namespace
}  // namespace vantage::planning
