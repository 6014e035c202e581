// A prior of the site in joint plans, and in plans that choose the setting: what one scanner's plan
// makes of it.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/fleet/joint_plan.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/setting_choice.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/site_prior/prior_space.h"
#include "core/site_prior/site_prior.h"

namespace vantage::fleet {
namespace {

// Two rooms of which one was scanned, and their mesh as the prior.
class SitePriorPlanTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4);
    config_.station_basis = planning::StationBasis::kExpected;
    config_.viewcell_size = 0.3;
    // What gains most overlaps by far more than has to be, so that no view is at that limit.
    config_.registration.prior_sigma = 0.05;  // m
    budget_.work_limit = 6'000'000;
    const simulation::Scene scene = simulation::TwoRooms(1);
    const simulation::SimulatedScanner tracer(scene.mesh);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(scene.starts[0]);
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer.Scan(scanner_, pose, simulation::ScanFaults{}, 1, pool_);
    ASSERT_TRUE(model_->Insert("scan", scan, pose, pool_).ok());
    view_ = model_->Publish();
    const auto prior =
        site_prior::SitePrior::Create({scene.mesh.vertices, scene.mesh.triangles}, {});
    ASSERT_TRUE(prior.ok()) << prior.status();
    const auto standing = site_prior::Judge(*view_, **prior);
    ASSERT_TRUE(standing.ok() && standing->used()) << standing.status();
    site_ = planning::ExpectedSite::Of(*standing->space).value();
    const auto problem =
        planning::PlanningProblem::Prepare({*view_, scanner_, config_, nullptr, site_}, pool_);
    ASSERT_TRUE(problem.ok()) << problem.status();
    alone_ = planning::MakePlan(**problem, budget_, pool_, [](const planning::Plan&) {});
    ASSERT_FALSE(alone_.views.empty());
  }

  sensor::ScannerModel scanner_;
  planning::PlanningConfig config_;
  parallel::Budget budget_ = parallel::Budget::Unlimited();
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_ = model::PartialModel::Create({}).value();
  std::shared_ptr<const model::PlanningView> view_;
  std::shared_ptr<const planning::ExpectedSite> site_;
  planning::Plan alone_;  // of one scanner, with the prior
};

TEST_F(SitePriorPlanTest, AJointPlanExpectsWhatAPlanDoes) {
  FleetRequest request;
  request.scanners.resize(1);
  request.scanners.front().model = scanner_;
  const auto plan_with = [&](const std::shared_ptr<const planning::ExpectedSite>& site) {
    request.site = site;
    return MakeJointPlan(*view_, request, config_, budget_, pool_, [](const planning::Plan&) {})
        .value()
        .plan;
  };
  const planning::Plan joint = plan_with(site_);
  ASSERT_FALSE(joint.views.empty());
  EXPECT_EQ(joint.views[0].position, alone_.views[0].position);
  EXPECT_EQ(joint.views[0].expected_gain, alone_.views[0].expected_gain);
  const planning::Plan without = plan_with(nullptr);
  ASSERT_FALSE(without.views.empty());
  EXPECT_NE(without.views[0].expected_gain, alone_.views[0].expected_gain);
}

TEST_F(SitePriorPlanTest, AChoiceOfSettingsExpectsWhatAPlanDoes) {
  const std::vector<planning::SettingOption> one = {{"only", scanner_, 1}};
  const planning::Plan chosen =
      planning::MakePlanChoosingSetting(
          *view_, one, config_, budget_, pool_, [](const planning::Plan&) {}, site_)
          .value();
  ASSERT_FALSE(chosen.views.empty());
  EXPECT_EQ(chosen.views[0].position, alone_.views[0].position);
  EXPECT_EQ(chosen.views[0].expected_gain, alone_.views[0].expected_gain);
}

}  // namespace
}  // namespace vantage::fleet
