// Views on places that are expected, in plans around what others have claimed or what is pending.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "core/fleet/joint_plan.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::fleet {
namespace {

TEST(ExpectedViewsTest, OfOneScannerNameTheKnownOneToTakeInstead) {
  parallel::ThreadPool pool(2);
  const simulation::Scene scene = simulation::TwoRooms(1);
  sensor::Scan scan;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.4);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(scene.starts[0]);
  scan.image = simulation::SimulatedScanner(scene.mesh).Scan(scan.scanner, pose, {}, 1, pool);
  const auto model = model::PartialModel::Create({}).value();
  ASSERT_TRUE(model->Insert("first", scan, pose, pool).ok());
  FleetRequest request;
  request.scanners.emplace_back().model = scan.scanner;
  request.pledged.push_back({scene.starts[0] + Eigen::Vector3d(0.8, 0, 0), scan.scanner, {}});
  planning::PlanningConfig config;
  config.station_basis = planning::StationBasis::kExpected;
  config.candidates = 20;
  parallel::Budget budget;
  budget.work_limit = 5'000'000;
  const auto plan =
      MakeJointPlan(*model->Publish(), request, config, budget, pool, [](const planning::Plan&) {});
  ASSERT_TRUE(plan.ok()) << plan.status();
  const auto& views = plan->plan.views;
  const auto known = std::find_if(views.begin(), views.end(),
                                  [](const auto& view) { return !view.expected.has_value(); });
  ASSERT_NE(known, views.end());
  size_t expected_views = 0;
  for (const planning::RankedView& view : views) {
    if (!view.expected.has_value()) continue;
    ++expected_views;
    EXPECT_EQ(view.expected->fallback, static_cast<size_t>(known - views.begin()));
  }
  EXPECT_GT(expected_views, 0u);
}

}  // namespace
}  // namespace vantage::fleet
