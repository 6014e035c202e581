// Compares whole cycles in rooms that deceive scanners with the same room without deceit.
#include <gtest/gtest.h>

#include <string>

#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/passing.h"
#include "core/simulation/scenes/scene.h"
#include "tests/support/closed_loop.h"

namespace vantage::planning {
namespace {

test_support::LoopOptions Options() {
  test_support::LoopOptions options;
  options.scanner.azimuth_step = options.scanner.elevation_step = sensor::Radians(0.3);
  options.planning.required_density = 1600;
  options.planning.viewcell_size = 0.2;
  return options;
}

// The operator is somewhere in every scan, and a cupboard's door never where it was.
test_support::LoopResult RunWithComings() {
  const simulation::Scene scene = simulation::PaneRoom({false, false, false, false});
  const simulation::SimulatedScanner still(scene.mesh);
  parallel::ThreadPool pool(2);
  return test_support::RunClosedLoop(
      [&](int scan, const Eigen::Vector3d& station) {
        simulation::TriangleMesh mesh = scene.mesh;
        simulation::MeshBuilder builder(mesh);
        const auto place =
            simulation::OperatorPlace(still, station, 0, static_cast<uint64_t>(scan) + 1);
        EXPECT_TRUE(place.has_value());
        if (place.has_value()) simulation::AddPerson(*place, 0.7 * scan, builder);
        simulation::AddDoorLeaf({{0.58, 0.4, 0}, 0.55, 1.9, sensor::kPi / 2},
                                scan % 2 == 0 ? -0.1 : -1.4, builder);
        return mesh;
      },
      scene.starts[0], Options(), pool);
}

test_support::LoopResult RunIn(const simulation::Panes& panes) {
  const simulation::Scene scene = simulation::PaneRoom(panes);
  parallel::ThreadPool pool(2);
  return test_support::RunClosedLoop([&](int, const Eigen::Vector3d&) { return scene.mesh; },
                                     scene.starts[0], Options(), pool);
}

// Scans after which the room without deceit is done. Each test is a process of its own, so that it
// is a number and not measured anew for each.
constexpr size_t kPlainScans = 6;

void ExpectSensible(const test_support::LoopResult& result) {
  std::string reasons;
  for (const Plan& plan : result.plans) reasons += plan.termination.reason + "\n";
  SCOPED_TRACE(reasons);
  std::printf("%zu scans, %zu in the plain room\n", result.stations.size(), kPlainScans);
  EXPECT_TRUE(result.stopped);
  EXPECT_LE(result.stations.size(), kPlainScans + 1);
  const Eigen::AlignedBox3d room(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.2, 4.2, 2.6));
  for (size_t i = 0; i < result.stations.size(); ++i) {
    EXPECT_TRUE(room.contains(result.stations[i])) << result.stations[i].transpose();
    for (size_t k = 0; k < i; ++k) {
      EXPECT_GT((result.stations[i] - result.stations[k]).norm(), 0.3)
          << "scans " << k << " and " << i;
    }
  }
  // Nor was anything else said to be feasible outside.
  for (const Plan& plan : result.plans) {
    for (const ScoredCell& cell : plan.score_map) {
      ASSERT_TRUE(room.contains(cell.centre.cast<double>())) << cell.centre.transpose();
    }
  }
}

TEST(ScepticalCycleTest, WithoutDeceitItTakesSixScans) {
  const test_support::LoopResult plain = RunIn({false, false, false, false});
  EXPECT_TRUE(plain.stopped);
  EXPECT_EQ(plain.stations.size(), kPlainScans);
}

TEST(ScepticalCycleTest, Windows) { ExpectSensible(RunIn({true, false, false, false})); }

TEST(ScepticalCycleTest, AMirror) {
  const test_support::LoopResult result = RunIn({false, true, false, false});
  ExpectSensible(result);
  // It is reported correctly: never measured, given up.
  EXPECT_GT(result.plans.back().coverage->area_given_up, 1.5);
  EXPECT_LT(result.plans.back().coverage->area_given_up, 3.5);
}

TEST(ScepticalCycleTest, WindowsAndAMirror) { ExpectSensible(RunIn({true, true, false, false})); }

TEST(ScepticalCycleTest, SomebodyWhoWalksAboutAndADoorThatMoves) {
  ExpectSensible(RunWithComings());
}

TEST(ScepticalCycleTest, APolishedFloor) { ExpectSensible(RunIn({false, false, true, false})); }

TEST(ScepticalCycleTest, ADarkCupboard) { ExpectSensible(RunIn({false, false, false, true})); }

}  // namespace
}  // namespace vantage::planning
