// The plan after the first scan of a street.
#include <gtest/gtest.h>

#include <cstdint>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/planning/planner.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

// After its first scan what gains most in a street lies far from the only station, behind houses,
// and overlaps too little; what lies nearer registers.
TEST(FirstStreetPlanTest, HasAViewThatRegisters) {
  for (const uint64_t seed : {3, 6}) {
    const simulation::Scene street = simulation::StreetScene(seed);
    SCOPED_TRACE(street.name);
    parallel::Serial serial;
    sensor::Scan scan;
    scan.scanner.range_max = 40;
    scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.5);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(street.starts[0]);
    scan.image =
        simulation::SimulatedScanner(street.mesh).Scan(scan.scanner, pose, {}, seed, serial);
    model::ModelConfig coarse;
    coarse.voxel_size = 0.1;
    const auto model = model::PartialModel::Create(coarse).value();
    ASSERT_TRUE(model->Insert("scan", scan, pose, serial).ok());
    PlanningConfig config;
    config.required_density = 400;
    parallel::Budget budget;
    budget.work_limit = 2'000'000;
    const auto plan =
        MakePlan(*model->Publish(), scan.scanner, config, budget, serial, [](const Plan&) {});
    ASSERT_TRUE(plan.ok()) << plan.status();
    EXPECT_FALSE(plan->views.empty()) << plan->message;
  }
}

}  // namespace
}  // namespace vantage::planning
