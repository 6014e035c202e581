// Plans of one scanner whose earlier scans have not come.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/core/fleet/flat_job.h"

namespace vantage::fleet {
namespace {

// What gains most lies beyond the stations that wait, where nothing registers before their scans
// are in; what registers is found all the same.
TEST(PlanBesidePendingTest, FindsAViewThatRegisters) {
  int plans = 0;
  int told = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    std::vector<PledgedView> pending;
    for (int station = 0; station < 5; ++station) {
      const JointPlan joint = job.Beside(pending);
      ++plans;
      EXPECT_FALSE(joint.plan.views.empty())
          << "beside " << pending.size() << ": " << joint.plan.message;
      if (joint.plan.views.empty()) break;
      const bool worth_more = std::any_of(
          joint.plan.refused.begin(), joint.plan.refused.end(),
          [&](const auto& other) { return other.score > 2 * joint.plan.views.front().score; });
      told += worth_more ? 1 : 0;
      EXPECT_EQ(joint.plan.message.find("not in yet") != std::string::npos,
                worth_more && !pending.empty())
          << joint.plan.message;
      pending.push_back({joint.plan.views.front().position, job.scanner()});
    }
  }
  std::printf("%d plans, %d with more to gain where nothing registers\n", plans, told);
  EXPECT_GT(told, 0);
}

// A station in a room that is expected should bring of what is known what the plan said, and
// registers as it said.
TEST(PlanBesidePendingTest, AStationWhereAPlanSentSomebodyBringsWhatThePlanSaid) {
  int expected = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    for (const planning::RankedView& view : job.ByScore(job.pool()).views) {
      if (!view.model_gain.has_value()) continue;
      const StationForecast forecast = job.Forecast(view.position);
      EXPECT_TRUE(forecast.registers) << forecast.why_not;
      EXPECT_NEAR(forecast.model_gain, *view.model_gain, 0.05 + 0.01 * *view.model_gain);
      expected += view.expected.has_value() ? 1 : 0;
    }
  }
  EXPECT_GT(expected, 0);
}

// Where the data of each scan come when the next one has been made, that one registers: by what is
// known then, not by what was guessed of a room that nobody had seen.
TEST(PlanBesidePendingTest, WhatIsPlannedBesideAStationRegistersWhenItsScanIsIn) {
  int planned = 0;
  int lost = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    std::vector<PledgedView> pending;
    for (int station = 0; station < 5; ++station) {
      const JointPlan joint = job.Beside(pending);
      if (joint.plan.views.empty()) break;
      const Eigen::Vector3d next = joint.plan.views.front().position;
      if (!pending.empty()) {
        job.ScanFrom(pending.front().position);
        ++planned;
        const registration::RegistrationVerdict verdict = job.Verdict(next);
        // Less is asked of a scan than of a prediction.
        lost += verdict.overlap_share < registration::RegistrationConfig().minimum_overlap ? 1 : 0;
      }
      pending = {{next, job.scanner()}};
    }
  }
  std::printf("%d planned, %d do not register\n", planned, lost);
  EXPECT_GT(planned, 15);
  EXPECT_EQ(lost, 0);
}

}  // namespace
}  // namespace vantage::fleet
