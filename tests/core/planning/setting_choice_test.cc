#include "core/planning/setting_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stop_token>
#include <vector>

#include "core/parallel/parallel.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

// It says what it is of, and how it ended, as any other plan does.
TEST(SettingChoiceTest, APlanThatIsCancelledBeforeItsFirstStepIsWhole) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  PlanningConfig config;
  config.viewcell_size = 0.4;
  config.seed = 77;
  std::stop_source stop;
  stop.request_stop();
  parallel::Budget budget;
  budget.cancelled = stop.get_token();
  parallel::Serial serial;
  const std::vector<SettingOption> options = {{"fine", {}, 5}, {"coarse", {}, 1}};
  const Plan plan =
      MakePlanChoosingSetting(model, options, config, budget, serial, [](const Plan&) {}).value();
  const Plan single =
      MakePlan(model, options[0].scanner, config, budget, serial, [](const Plan&) {}).value();
  EXPECT_EQ(plan.outcome, PlanOutcome::kCancelled);
  EXPECT_EQ(plan.message, single.message);
  EXPECT_EQ(plan.model_version, model.version());
  EXPECT_EQ(plan.seed, 77u);
  EXPECT_EQ(plan.required_density, config.required_density);
  EXPECT_EQ(plan.termination.reason, single.termination.reason);
  EXPECT_THAT(plan.termination.reason, ::testing::HasSubstr("no view was evaluated"));
  EXPECT_TRUE(plan.views.empty());
}

}  // namespace
}  // namespace vantage::planning
