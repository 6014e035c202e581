#include <gtest/gtest.h>

#include "client/cli/command.h"

namespace vantage::cli {
namespace {

v1::Plan Ended(v1::PlanState state, v1::PlanOutcome outcome) {
  v1::Plan plan;
  plan.set_state(state);
  plan.mutable_result()->set_outcome(outcome);
  return plan;
}

TEST(ExitCode, OfAPlanTellsAFaultFromAnAnswer) {
  const auto succeeded = [](v1::PlanOutcome outcome) {
    return ExitCodeOf(Ended(v1::PLAN_STATE_SUCCEEDED, outcome));
  };
  EXPECT_EQ(succeeded(v1::PLAN_OUTCOME_VIEWS), ExitCode::kOk);
  EXPECT_EQ(succeeded(v1::PLAN_OUTCOME_NOTHING_TO_GAIN), ExitCode::kOk);
  EXPECT_EQ(succeeded(v1::PLAN_OUTCOME_NO_FEASIBLE_VIEW), ExitCode::kUnwelcome);
  EXPECT_EQ(succeeded(v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW), ExitCode::kUnwelcome);
  EXPECT_EQ(succeeded(v1::PLAN_OUTCOME_SEARCH_UNFINISHED), ExitCode::kTryAgain);
  EXPECT_EQ(ExitCodeOf(Ended(v1::PLAN_STATE_CANCELLED, v1::PLAN_OUTCOME_CANCELLED)),
            ExitCode::kTryAgain);
  v1::Plan failed;
  failed.set_state(v1::PLAN_STATE_FAILED);
  EXPECT_EQ(ExitCodeOf(failed), ExitCode::kInternal);
}

}  // namespace
}  // namespace vantage::cli
