#include "client/cli/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Report, WhereNoFloorIsKnownBelowThereIsNoHeightOverIt) {
  v1::Plan plan;
  plan.set_state(v1::PLAN_STATE_SUCCEEDED);
  v1::RankedView& view = *plan.mutable_result()->add_views();
  view.set_height_over_floor_m(std::numeric_limits<double>::quiet_NaN());
  view.set_clearance_m(0.5);
  const std::string report = PlanReport(plan);
  EXPECT_THAT(report, Not(HasSubstr("nan")));
  EXPECT_THAT(report, HasSubstr("station    no floor is known below, clearance 50.0 cm"));
  view.set_height_over_floor_m(1.45);
  EXPECT_THAT(PlanReport(plan), HasSubstr("station    1.45 m over the floor"));
}

}  // namespace
}  // namespace vantage::cli
