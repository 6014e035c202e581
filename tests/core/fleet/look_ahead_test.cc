// The scan after the next, against scans that are made.
#include "core/fleet/look_ahead.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "tests/core/fleet/flat_job.h"

namespace vantage::fleet {
namespace {

TEST(LookAheadTest, TheRefusedViewRegistersOnceTheFirstIsScanned) {
  int enabled = 0;
  int kept = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    for (int scan = 0; scan < 4; ++scan) {
      const planning::Plan plan = job.LookingAhead(job.pool());
      ASSERT_FALSE(plan.views.empty());
      const planning::RankedView& first = plan.views.front();
      EXPECT_TRUE(first.verdict.registered());
      if (!first.enables.has_value()) {
        job.ScanFrom(first.position);
        continue;
      }
      ASSERT_LT(*first.enables, plan.refused.size());
      const planning::RankedView& refused = plan.refused[*first.enables];
      EXPECT_GT(refused.score, first.score);
      EXPECT_FALSE(refused.verdict.registered());
      job.ScanFrom(first.position);
      ++enabled;
      kept += job.Verdict(refused.position).registered() ? 1 : 0;
    }
  }
  std::printf("%d of %d refused views register after the first\n", kept, enabled);
  EXPECT_GT(enabled, 2) << "or this says nothing";
  EXPECT_GE(4 * kept, 3 * enabled);
}

// All but the first keep their order, and their figures stay.
TEST(LookAheadTest, MovesOneViewAtMost) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    const planning::Plan plan = job.LookingAhead(job.pool());
    planning::Plan by_score = job.ByScore(job.pool());
    ASSERT_EQ(plan.views.size(), by_score.views.size());
    const Eigen::Vector3d first = plan.views.front().position;
    const auto moved =
        std::find_if(by_score.views.begin(), by_score.views.end(),
                     [&](const planning::RankedView& v) { return v.position == first; });
    ASSERT_NE(moved, by_score.views.end());
    EXPECT_TRUE(moved == by_score.views.begin() || plan.views.front().enables.has_value());
    std::rotate(by_score.views.begin(), moved, moved + 1);
    for (size_t i = 0; i < plan.views.size(); ++i) {
      EXPECT_EQ(plan.views[i].position, by_score.views[i].position);
      EXPECT_EQ(plan.views[i].score, by_score.views[i].score);
      EXPECT_EQ(plan.views[i].verdict.judged_bound, by_score.views[i].verdict.judged_bound);
      EXPECT_TRUE(i == 0 || !plan.views[i].enables.has_value());
    }
  }
}

// Advice on targets names the view that is to be scanned first, wherever that stands now.
TEST(LookAheadTest, AdviceOnTargetsNamesTheSameView) {
  size_t moved = 0;
  for (uint64_t seed = 1; seed <= 8 && moved == 0; ++seed) {
    SCOPED_TRACE(testing::Message() << "flat " << seed);
    FlatJob job(seed);
    job.ScanFrom(job.starts()[0]);
    for (int scan = 0; scan < 4 && moved == 0; ++scan) {
      planning::Plan plan = job.ByScore(job.pool());
      ASSERT_FALSE(plan.views.empty());
      const std::vector<planning::RankedView> before = plan.views;
      if (plan.refused.size() >= before.size()) {
        for (size_t k = 0; k < before.size(); ++k) {
          plan.refused[k].targets.emplace().first_view = k;
        }
        job.LookAheadIn(plan);
        for (size_t k = 0; k < before.size(); ++k) {
          ASSERT_TRUE(plan.refused[k].targets->first_view.has_value());
          EXPECT_EQ(plan.views[*plan.refused[k].targets->first_view].position, before[k].position);
        }
        moved += plan.views.front().position != before.front().position ? 1 : 0;
      }
      job.ScanFrom(plan.views.front().position);
    }
  }
  EXPECT_GT(moved, 0u) << "or this says nothing";
}

TEST(LookAheadTest, IsTheSameOnAnyNumberOfThreads) {
  FlatJob job(2);
  job.ScanFrom(job.starts()[0]);
  parallel::Serial serial;
  const planning::Plan one = job.LookingAhead(serial);
  const planning::Plan two = job.LookingAhead(job.pool());
  EXPECT_EQ(one.rays, two.rays);
  ASSERT_EQ(one.views.size(), two.views.size());
  for (size_t i = 0; i < one.views.size(); ++i) {
    EXPECT_EQ(one.views[i].position, two.views[i].position);
    EXPECT_EQ(one.views[i].enables, two.views[i].enables);
  }
}

}  // namespace
}  // namespace vantage::fleet
