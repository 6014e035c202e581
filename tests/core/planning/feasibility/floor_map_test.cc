#include "core/planning/feasibility/floor_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "core/parallel/parallel.h"
#include "core/planning/feasibility/feasible_views.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;

// A room of 8 x 5 m with its floor at z = 0 and a station in it.
test_support::ClosedFormScene Room(double height,
                                   const std::function<bool(const Vector3d&)>& solid) {
  test_support::ClosedFormScene scene;
  const Region room(Vector3d::Zero(), Vector3d(8, 5, height));
  scene.extent = Region(Vector3d(-0.1, -0.1, -0.7), Vector3d(8.1, 5.1, height + 0.1));
  scene.solid = [=](const Vector3d& p) {
    return (!room.contains(p) && p.z() > -0.6) || p.z() < -0.6 || solid(p);
  };
  scene.stations = {test_support::MakeStation(Vector3d(1.2, 2.5, 1.5))};
  return scene;
}

bool Nothing(const Vector3d&) { return false; }

// The floors in the column of voxels at a place.
std::span<const Floor> FloorsAt(const FloorMap& map, double x, double y) {
  return map.columns().At(static_cast<int>(std::floor(x / 0.05)),
                          static_cast<int>(std::floor(y / 0.05)));
}

FloorMap MapOf(const test_support::ClosedFormScene& scene) {
  return FloorMap::Find(test_support::BuildView(scene), std::nullopt).value();
}

// What is hidden is not known, be it solid or not.
void Hide(test_support::ClosedFormScene& scene,
          const std::function<bool(const Vector3d&)>& hidden) {
  scene.known = [=](const Vector3d& p) { return !hidden(p); };
  scene.solid = [=, solid = scene.solid](const Vector3d& p) { return solid(p) && !hidden(p); };
}

// A strip of floor that was not measured, from x = 4 on.
class FloorGapTest : public ::testing::Test {
 protected:
  test_support::ClosedFormScene Strip(double width, model::VoxelState kind) {
    test_support::ClosedFormScene scene = Room(2.7, Nothing);
    Hide(scene, [=](const Vector3d& p) { return p.z() < 0 && p.x() > 4 && p.x() < 4 + width; });
    scene.false_kind = [=](const Vector3d&) { return kind; };
    return scene;
  }
};

TEST_F(FloorGapTest, AroundAStationItIsClosedBetweenFloorAndSaid) {
  test_support::ClosedFormScene scene = Strip(1.2, model::VoxelState::kFalseImage);
  scene.stations = {test_support::MakeStation(Vector3d(4.6, 2.5, 1.5))};
  const FloorMap map = MapOf(scene);
  for (const double y : {1.6, 2.0, 3.0, 3.4}) {
    ASSERT_EQ(FloorsAt(map, 4.62, y).size(), 1u) << y;
    EXPECT_EQ(FloorsAt(map, 4.62, y)[0].source, FloorSource::kBetween);
    EXPECT_NEAR(FloorsAt(map, 4.62, y)[0].height, 0, 0.04);
  }
  EXPECT_EQ(FloorsAt(map, 4.62, 2.52)[0].source, FloorSource::kStation);
  EXPECT_EQ(FloorsAt(map, 5.62, 2.52)[0].source, FloorSource::kMeasured);
  EXPECT_TRUE(FloorsAt(map, 4.62, 4.6).empty()) << "far from the station";

  const model::PlanningView model = test_support::BuildView(scene);
  const sensor::ScannerModel scanner;
  parallel::Serial serial;
  const FeasibleViews views =
      FeasibleViews::Find(model, visibility::OpaqueGrid(model), scanner, {}, serial).value();
  EXPECT_GE(views.IndexOf(views.CellOf({4.65, 3.05, 1.55})), 0);
  EXPECT_FALSE(views.FloorMeasured({4.65, 3.05, 1.55}));
  EXPECT_TRUE(views.FloorMeasured({6.05, 2.55, 1.55}));
}

// Lost rays and shadows may hide a drop; those of scanners that see less of the floor may not.
TEST_F(FloorGapTest, BesideTheConeOnlyTheFieldOfViewExplainsAGap) {
  for (const auto& [kind, closed] : {std::pair{model::VoxelState::kFalseImage, true},
                                     {model::VoxelState::kFalseHole, false},
                                     {model::VoxelState::kFalseOcclusion, false}}) {
    test_support::ClosedFormScene scene = Strip(0.6, kind);
    scene.stations = {test_support::MakeStation(Vector3d(5.8, 2.5, 1.5))};
    EXPECT_EQ(FloorsAt(MapOf(scene), 4.3, 2.52).size(), closed ? 1u : 0u);
    scene.stations = {test_support::MakeStation(Vector3d(7.2, 2.5, 1.5))};
    EXPECT_TRUE(FloorsAt(MapOf(scene), 4.3, 2.52).empty());
  }
}

TEST_F(FloorGapTest, ANarrowGapIsClosedAnywhere) {
  EXPECT_EQ(FloorsAt(MapOf(Strip(0.25, model::VoxelState::kFalseOcclusion)), 4.1, 2.5).size(), 1u);
  EXPECT_TRUE(FloorsAt(MapOf(Strip(0.6, model::VoxelState::kFalseOcclusion)), 4.3, 2.5).empty());
}

TEST_F(FloorGapTest, APitIsNotClosedAndNothingGrowsOverIt) {
  test_support::ClosedFormScene scene = Room(2.7, Nothing);
  const auto room = scene.solid;
  const Region pit(Vector3d(4, 1, -0.5), Vector3d(5, 4, 0.1));
  scene.solid = [=](const Vector3d& p) { return room(p) && !pit.contains(p); };
  const FloorMap map = MapOf(scene);
  ASSERT_EQ(FloorsAt(map, 4.5, 2.5).size(), 1u);
  EXPECT_NEAR(FloorsAt(map, 4.5, 2.5)[0].height, -0.5, 0.06);
  // Where its own floor is not known either, there is none.
  Hide(scene, [](const Vector3d& p) { return p.z() < -0.25; });
  for (double x = 4.1; x < 4.95; x += 0.05) EXPECT_TRUE(FloorsAt(MapOf(scene), x, 2.5).empty());
}

// What lies in a shadow may be walked over, but nobody is sent to stand there: the room beyond is
// reached, and no place over the shadow is offered.
TEST_F(FloorGapTest, WaysGoOnInAShadowAndPlacesDoNot) {
  const sensor::ScannerModel scanner;
  const PlanningConfig config;
  parallel::Serial serial;
  for (const auto& [width, reached] : {std::pair{1.5, true}, {2.9, false}}) {
    const test_support::ClosedFormScene scene = Strip(width, model::VoxelState::kFalseOcclusion);
    const model::PlanningView model = test_support::BuildView(scene);
    const FloorMap map = FloorMap::Find(model, std::nullopt).value();
    const FloorMap ways = map.WithShadows(model).value();
    for (uint32_t column = 0; column < map.columns().columns(); ++column) {
      ASSERT_GE(ways.columns().In(column).size(), map.columns().In(column).size());
    }
    EXPECT_TRUE(FloorsAt(map, 4.7, 2.52).empty());
    ASSERT_EQ(FloorsAt(ways, 4.7, 2.52).size(), reached ? 1u : 0u);
    for (const Floor& floor : FloorsAt(ways, 4.7, 2.52)) {
      EXPECT_EQ(floor.source, FloorSource::kExpected);
    }
    const visibility::OpaqueGrid grid(model);
    const FeasibleViews known =
        FeasibleViews::Find(model, map, grid, scanner, config, serial).value();
    const FeasibleViews expected =
        FeasibleViews::FindExpected(model, map, ways, grid, known, scanner, config, serial).value();
    const Vector3d beyond(7.55, 2.55, 1.55);
    EXPECT_EQ(known.IndexOf(known.CellOf(beyond)), -1);
    EXPECT_EQ(expected.IndexOf(expected.CellOf(beyond)) >= 0, reached);
    EXPECT_EQ(expected.IndexOf(expected.CellOf({4.75, 2.55, 1.55})), -1);
  }
}

// Somebody who saw over an edge, and not its ground, has seen that there is no floor.
TEST_F(FloorGapTest, NoWayLeadsOverADrop) {
  test_support::ClosedFormScene scene = Room(2.7, Nothing);
  Hide(scene, [](const Vector3d& p) { return p.z() < -0.25 && p.x() > 4 && p.x() < 5; });
  const auto solid = scene.solid;
  scene.solid = [=](const Vector3d& p) {
    return solid(p) && !(p.x() > 4 && p.x() < 5 && p.z() < 0.1);
  };
  const model::PlanningView model = test_support::BuildView(scene);
  const FloorMap map = FloorMap::Find(model, std::nullopt).value();
  EXPECT_TRUE(FloorsAt(map, 4.5, 2.5).empty());
  EXPECT_TRUE(FloorsAt(map.WithShadows(model).value(), 4.5, 2.5).empty());
}

TEST_F(FloorGapTest, NothingGrowsOutwardWhereTheFloorEnds) {
  test_support::ClosedFormScene scene = Room(2.7, Nothing);
  Hide(scene, [](const Vector3d& p) { return p.z() < 0 && p.x() > 4; });
  scene.false_kind = [](const Vector3d&) { return model::VoxelState::kFalseImage; };
  const FloorMap map = MapOf(scene);
  EXPECT_FALSE(FloorsAt(map, 3.9, 2.5).empty());
  for (double x = 4.1; x < 7.9; x += 0.1) EXPECT_TRUE(FloorsAt(map, x, 2.5).empty()) << x;
}

TEST(FloorMapTest, FurnitureIsNoFloorAndAMezzanineIs) {
  const auto boxes = [](const Vector3d& p) {
    const Region table(Vector3d(3, 1, 0.7), Vector3d(4.5, 2, 0.75));
    const Region counter(Vector3d(3, 4.2, 0), Vector3d(5.4, 5, 0.9));
    const Region wardrobe(Vector3d(0, 0, 0), Vector3d(3, 0.8, 2.2));
    return table.contains(p) || counter.contains(p) || wardrobe.contains(p);
  };
  const FloorMap low = MapOf(Room(2.7, boxes));
  for (const Floor& floor : low.columns().floors()) EXPECT_LT(std::abs(floor.height), 0.06);
  EXPECT_EQ(low.storeys().count(), 1u);

  const FloorMap high = MapOf(Room(5.4, [&](const Vector3d& p) {
    return boxes(p) || Region(Vector3d(5, 0, 2.5), Vector3d(8, 5, 2.7)).contains(p);
  }));
  ASSERT_EQ(FloorsAt(high, 6.5, 2.5).size(), 2u);
  EXPECT_NEAR(FloorsAt(high, 6.5, 2.5)[0].height, 0, 0.06);
  EXPECT_NEAR(FloorsAt(high, 6.5, 2.5)[1].height, 2.7, 0.06);
  ASSERT_EQ(high.storeys().count(), 2u);
  EXPECT_NEAR(*high.storeys().Height(1), 2.7, 0.06);
}

TEST(FloorMapTest, AGivenFloorIsEverywhereAndIsNotMeasured) {
  const FloorMap map =
      FloorMap::Find(test_support::BuildView(Room(2.7, Nothing)), std::optional(0.3)).value();
  EXPECT_EQ(map.lowest(), 0.3f);
  EXPECT_EQ(map.highest(), 0.3f);
  ASSERT_EQ(FloorsAt(map, 7.9, 4.9).size(), 1u);
  EXPECT_FALSE(FloorsAt(map, 7.9, 4.9)[0].measured());
}

}  // namespace
}  // namespace vantage::planning
