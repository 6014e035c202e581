// What was promised of a place and what a scan from there brought, side by side.
#include "server/session/gain_promise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/planning/openings/measure_coverage.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::session {
namespace {

v1::Scan ScanAt(double x, double y, double z) {
  v1::Scan scan;
  v1::Vector3& at = *scan.mutable_pose()->mutable_translation();
  at.set_x(x);
  at.set_y(y);
  at.set_z(z);
  return scan;
}

class PromiseTest : public testing::Test {
 protected:
  PromiseTest() { state_.model_version = 3; }

  // A plan with views at these places along x, the first of which gains 10 m2, the next 9 ...
  std::string AddPlan(uint64_t model_version, const std::vector<double>& places) {
    std::string name = absl::StrCat("plan-", state_.plan_order.size() + 1);
    v1::Plan& plan = state_.plans[name].plan;
    plan.mutable_result()->set_model_version(model_version);
    double gain = 10;
    for (const double x : places) {
      v1::RankedView& view = *plan.mutable_result()->add_views();
      *view.mutable_position() = ScanAt(x, 0, 1.5).pose().translation();
      view.set_model_gain_m2(gain);
      view.set_model_gain_lower_m2(gain);
      view.set_model_gain_upper_m2(gain);
      view.set_expected_gain_m2(2 * gain);
      view.set_expected_gain_lower_m2(gain / 2);
      view.set_expected_gain_upper_m2(3 * gain);
      gain -= 1;
    }
    state_.plan_order.push_back(name);
    return name;
  }

  SessionState state_;
};

TEST_F(PromiseTest, IsThatOfTheViewAtItsPlace) {
  const std::string plan = AddPlan(3, {0, 4, 8});
  const auto promise = PromiseOf(state_, ScanAt(4.3, 0.2, 1.8));
  ASSERT_TRUE(promise.has_value());
  EXPECT_EQ(promise->plan(), plan);
  EXPECT_EQ(promise->view_index(), 1);
  EXPECT_EQ(promise->model_gain_m2(), 9);
  EXPECT_EQ(promise->expected_gain_m2(), 18);
  EXPECT_EQ(promise->expected_gain_lower_m2(), 4.5);
  EXPECT_EQ(promise->expected_gain_upper_m2(), 27);
  EXPECT_FALSE(PromiseOf(state_, ScanAt(4.6, 0, 1.5)).has_value());
  EXPECT_FALSE(PromiseOf(state_, ScanAt(4, 0, 4.3)).has_value()) << "on another storey";
}

TEST_F(PromiseTest, IsOfTheNewestPlanThatNamesThePlace) {
  AddPlan(3, {0, 4});
  const std::string newer = AddPlan(3, {4});
  AddPlan(3, {8});
  state_.plans["plan-4"].plan.set_state(v1::PLAN_STATE_RUNNING);
  state_.plan_order.emplace_back("plan-4");
  EXPECT_EQ(PromiseOf(state_, ScanAt(4, 0, 1.5))->plan(), newer);
  EXPECT_EQ(PromiseOf(state_, ScanAt(0, 0, 1.5))->plan(), "plan-1");
}

TEST_F(PromiseTest, AViewWhoseGainIsNotKnownPromisesNothingRatherThanZero) {
  const std::string older = AddPlan(3, {0});
  v1::RankedView& view = *state_.plans[AddPlan(3, {0})].plan.mutable_result()->mutable_views(0);
  EXPECT_EQ(PromiseOf(state_, ScanAt(0, 0, 1.5))->plan(), "plan-2");
  view.clear_expected_gain_m2();
  view.clear_model_gain_m2();
  view.clear_model_gain_lower_m2();
  EXPECT_EQ(PromiseOf(state_, ScanAt(0, 0, 1.5))->plan(), older);
  state_.plan_order.erase(state_.plan_order.begin());
  EXPECT_FALSE(PromiseOf(state_, ScanAt(0, 0, 1.5)).has_value());
}

// Of a scanner that sees a sector a scan that faces elsewhere was not what the view is for.
TEST_F(PromiseTest, IsThatOfTheSectorThatTheScanShows) {
  v1::ScannerModel& model = *state_.session.add_scanner_models();
  model.set_id("front");
  model.set_azimuth_span_rad(2);
  v1::Plan& plan = state_.plans[AddPlan(3, {0})].plan;
  plan.set_scanner_model_id("front");
  plan.mutable_result()->mutable_views(0)->set_heading_rad(3);
  const auto facing = [](double heading) {
    v1::Scan scan = ScanAt(0, 0, 1.5);
    scan.mutable_pose()->mutable_rotation()->set_w(std::cos(heading / 2));
    scan.mutable_pose()->mutable_rotation()->set_z(std::sin(heading / 2));
    return scan;
  };
  EXPECT_TRUE(PromiseOf(state_, facing(3)).has_value());
  EXPECT_TRUE(PromiseOf(state_, facing(-3)).has_value()) << "across the half turn";
  EXPECT_FALSE(PromiseOf(state_, facing(2.4)).has_value());
  EXPECT_FALSE(PromiseOf(state_, facing(0)).has_value());
}

// Another scan may have brought what was promised then.
TEST_F(PromiseTest, AnEarlierModelsPlansPromiseNothing) {
  AddPlan(2, {0});
  EXPECT_FALSE(PromiseOf(state_, ScanAt(0, 0, 1.5)).has_value());
}

// Gains obtained add up to what the model has.
TEST(ObtainedGain, AddsUpToWhatIsAtDensity) {
  store::MemoryStore store{size_t{64} << 20};
  fixture::Script script;
  script.EndPlans();
  const auto host = std::make_unique<fixture::SessionHost>(store, script.Make());
  const auto session = fixture::OpenSession(host->registry, "job");
  // As coarse as the room's scans are.
  v1::UpdateSessionRequest coarse;
  coarse.mutable_session()->mutable_planning_config()->set_required_density_per_m2(100);
  coarse.mutable_update_mask()->add_paths("planning_config.required_density_per_m2");
  ASSERT_TRUE(session->Update(coarse).ok());
  double sum = 0;
  for (const double x : {1.0, 2.5, 4.0}) {
    const std::string name = fixture::SendRoom(*session, {x, 1.5, 1.4}).value();
    const v1::MergeReport merge = session->scans().Get(name).value().merge();
    ASSERT_TRUE(merge.has_obtained_gain_m2());
    EXPECT_FALSE(merge.has_promise());
    sum += merge.obtained_gain_m2();
    planning::PlanningConfig config;
    config.required_density = session->Describe().planning_config().required_density_per_m2();
    const auto view = session->model().Current().view;
    sensor::ScannerModel scanner;
    const auto coverage = planning::MeasureCoverage(*view, {&scanner, 1}, config);
    ASSERT_TRUE(coverage.ok());
    EXPECT_NEAR(sum, coverage->area_at_density, 1e-6);
  }
  EXPECT_GT(sum, 1);
}

}  // namespace
}  // namespace vantage::session
