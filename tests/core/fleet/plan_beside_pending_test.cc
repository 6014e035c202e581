// Plans of one scanner whose earlier scans have not come.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/core/fleet/flat_job.h"

namespace vantage::fleet {
namespace {

class PlanBesidePendingTest : public testing::TestWithParam<uint64_t> {};

// What gains most lies beyond the stations that wait, where nothing registers before their scans
// are in; what registers is found all the same, and where more waits it is said.
TEST_P(PlanBesidePendingTest, FindsAViewThatRegisters) {
  FlatJob job(GetParam());
  job.ScanFrom(job.starts()[0]);
  std::vector<PledgedView> pending;
  for (int station = 0; station < 5; ++station) {
    const JointPlan joint = job.Beside(pending);
    ASSERT_FALSE(joint.plan.views.empty())
        << "beside " << pending.size() << ": " << joint.plan.message;
    const bool worth_more = std::any_of(
        joint.plan.refused.begin(), joint.plan.refused.end(),
        [&](const auto& other) { return other.score > 2 * joint.plan.views.front().score; });
    EXPECT_EQ(joint.plan.message.find("not in yet") != std::string::npos,
              worth_more && !pending.empty())
        << joint.plan.message;
    pending.push_back({joint.plan.views.front().position, job.scanner()});
  }
}

// A station in a room that is expected should bring of what is known what the plan said, and
// registers as it said.
TEST_P(PlanBesidePendingTest, AStationWhereAPlanSentSomebodyBringsWhatThePlanSaid) {
  FlatJob job(GetParam());
  job.ScanFrom(job.starts()[0]);
  int expected = 0;
  for (const planning::RankedView& view : job.ByScore(job.pool()).views) {
    if (!view.model_gain.has_value()) continue;
    const StationForecast forecast = job.Forecast(view.position);
    EXPECT_TRUE(forecast.registers) << forecast.why_not;
    EXPECT_NEAR(forecast.model_gain, *view.model_gain, 0.05 + 0.01 * *view.model_gain);
    expected += view.expected.has_value() ? 1 : 0;
  }
  EXPECT_GT(expected, 0);
}

// Where the data of each scan come when the next one has been made, that one registers: by what is
// known then, not by what was guessed of a room that nobody had seen.
TEST_P(PlanBesidePendingTest, WhatIsPlannedBesideAStationRegistersWhenItsScanIsIn) {
  FlatJob job(GetParam());
  job.ScanFrom(job.starts()[0]);
  std::vector<PledgedView> pending;
  int planned = 0;
  for (int station = 0; station < 5; ++station) {
    const JointPlan joint = job.Beside(pending);
    if (joint.plan.views.empty()) break;
    const Eigen::Vector3d next = joint.plan.views.front().position;
    if (!pending.empty()) {
      job.ScanFrom(pending.front().position);
      ++planned;
      // Less is asked of a scan than of a prediction.
      EXPECT_GE(job.Verdict(next).overlap_share,
                registration::RegistrationConfig().minimum_overlap);
    }
    pending = {{next, job.scanner()}};
  }
  EXPECT_GE(planned, 3);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlanBesidePendingTest, testing::Range<uint64_t>(1, 7));

}  // namespace
}  // namespace vantage::fleet
