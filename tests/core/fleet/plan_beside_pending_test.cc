// Plans of one scanner whose earlier scans have not come.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "tests/core/fleet/flat_job.h"

namespace vantage::fleet {
namespace {

// What gains most lies beyond the stations that wait, where nothing registers before their scans
// are in; what registers is found all the same.
TEST(PlanBesidePendingTest, FindsAViewThatRegisters) {
  int plans = 0;
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
      pending.push_back({joint.plan.views.front().position, job.scanner()});
    }
  }
  std::printf("%d plans\n", plans);
}

}  // namespace
}  // namespace vantage::fleet
