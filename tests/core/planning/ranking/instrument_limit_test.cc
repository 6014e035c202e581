// Plans with an instrument that cannot meet what is required of it, and with one that can.
#include "core/planning/ranking/instrument_limit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "core/parallel/thread_pool.h"
#include "core/planning/planner.h"
#include "core/registration/bound/instrument_limit.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::planning {
namespace {

class PlannedInstrumentLimit : public testing::Test {
 protected:
  Plan PlanWith(const registration::RegistrationConfig& registration,
                const sensor::ScannerModel& scanner = {}) {
    PlanningConfig config;
    config.registration = registration;
    problem_ = PlanningProblem::Prepare({*model_, scanner, config}, pool_).value();
    parallel::Budget budget;
    budget.work_limit = 3'000'000;
    return MakePlan(*problem_, budget, pool_, [](const Plan&) {});
  }
  // As if scans had shown that blocks of surface are off by that much (m).
  static registration::InstrumentResiduals Showing(double shared) {
    registration::PairResiduals pair{};
    for (registration::ClassResiduals& of : pair) of = {1e6, 1e6 * shared * shared, 1e7, 0, 0};
    registration::InstrumentResiduals shown;
    shown.Add(pair);
    return shown;
  }

  parallel::ThreadPool pool_{2};
  std::shared_ptr<const model::PlanningView> model_ = registration::ModelFromScan(
      registration::FurnishedRoom(5), registration::PoseAt({0.4, 0.5, 1.4}, 0.3), {}, 105);
  std::shared_ptr<const PlanningProblem> problem_;
};

TEST_F(PlannedInstrumentLimit, APlanSaysWhatTheInstrumentCan) {
  registration::RegistrationConfig config;
  config.instrument = Showing(0.02);
  const Plan plan = PlanWith(config);
  EXPECT_TRUE(plan.views.empty());
  EXPECT_EQ(plan.outcome, PlanOutcome::kNoRegistrableView) << plan.message;
  ASSERT_TRUE(plan.attainable_accuracy.has_value()) << plan.message;
  EXPECT_THAT(plan.message, testing::HasSubstr("cannot be met with this instrument"));
  EXPECT_THAT(plan.message, testing::HasSubstr(registration::InstrumentLimitReason(
                                *plan.attainable_accuracy, config)));
  EXPECT_THAT(plan.message, testing::HasSubstr("set required_accuracy to"));
  // What is named can be met, with the margin of predictions, and half of it cannot.
  config.required_accuracy = 1.3 * *plan.attainable_accuracy;
  const Plan less = PlanWith(config);
  EXPECT_FALSE(less.views.empty()) << less.message;
  EXPECT_FALSE(less.attainable_accuracy.has_value());
  config.required_accuracy = 0.5 * *plan.attainable_accuracy;
  EXPECT_TRUE(PlanWith(config).views.empty());
}

TEST_F(PlannedInstrumentLimit, ByTheDataSheetAlone) {
  sensor::ScannerModel coarse;
  coarse.range_noise = 0.5;
  registration::RegistrationConfig config;
  config.required_accuracy = 0.002;
  config.correlated_sigma = 0.004;
  const Plan plan = PlanWith(config, coarse);
  ASSERT_TRUE(plan.attainable_accuracy.has_value()) << plan.message;
  EXPECT_GT(*plan.attainable_accuracy, 0.002);
}

TEST_F(PlannedInstrumentLimit, IsNoFalseAlarm) {
  // An instrument as on its sheet, from views that overlap by enough.
  const Plan plan = PlanWith({});
  EXPECT_FALSE(plan.views.empty()) << plan.message;
  EXPECT_FALSE(plan.attainable_accuracy.has_value());
  // Where the views are refused for another reason than their bound.
  registration::RegistrationConfig config;
  config.instrument = Showing(0.003);
  config.minimum_overlap = 0.995;
  const Plan refused = PlanWith(config);
  EXPECT_TRUE(refused.views.empty());
  EXPECT_FALSE(refused.attainable_accuracy.has_value()) << refused.message;
}

}  // namespace
}  // namespace vantage::planning
