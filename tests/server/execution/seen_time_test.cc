// Time that was seen, and a wall clock that jumps.
#include "server/execution/seen_time.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "server/execution/steadied_clock.h"

namespace vantage::execution {
namespace {

TEST(SeenTimeTest, GoesOnFromWhatWasSeenBefore) {
  absl::Duration steady = absl::Hours(1000);
  SeenTime seen([&] { return steady; });
  EXPECT_EQ(seen.Now(), absl::ZeroDuration());
  steady += absl::Seconds(10);
  EXPECT_EQ(seen.Now(), absl::Seconds(10));
  seen.Resume(absl::Hours(5));
  EXPECT_EQ(seen.Now(), absl::Hours(5));
  steady += absl::Milliseconds(1500);
  EXPECT_EQ(seen.Now(), absl::Hours(5) + absl::Milliseconds(1500));
  // What is behind takes nothing back, nor does a steady clock that is not steady.
  seen.Resume(absl::Hours(4));
  EXPECT_EQ(seen.Now(), absl::Hours(5) + absl::Milliseconds(1500));
  steady = absl::ZeroDuration();
  EXPECT_LE(seen.Now(), absl::Hours(5) + absl::Milliseconds(1500));
}

class SteadiedClockTest : public testing::Test {
 protected:
  void Pass(absl::Duration time) {
    steady_ += time;
    wall_ += time;
  }

  const absl::Time start_ = absl::FromUnixSeconds(1'700'000'000);
  absl::Time wall_ = start_;
  absl::Duration steady_ = absl::Hours(3);
  std::vector<std::pair<absl::Duration, bool>> told_;
  SteadiedClock clock_{
      [this] { return wall_; }, [this] { return steady_; },
      [this](absl::Duration by, bool followed) { told_.emplace_back(by, followed); }};
};

TEST_F(SteadiedClockTest, FollowsWhatPassesAndSmallSteps) {
  EXPECT_EQ(clock_.Now(), start_);
  Pass(absl::Hours(30));
  EXPECT_EQ(clock_.Now(), start_ + absl::Hours(30));
  for (int i = 0; i < 100; ++i) {
    wall_ += absl::Seconds(2);  // a clock that is drawn to the right time
    EXPECT_EQ(clock_.Now(), wall_);
  }
  EXPECT_TRUE(told_.empty());
}

TEST_F(SteadiedClockTest, AJumpForAMomentIsToldAndNotFollowed) {
  for (const absl::Duration jump : {absl::Hours(25), -absl::Hours(24 * 3650), absl::Seconds(6)}) {
    SCOPED_TRACE(jump);
    told_.clear();
    const absl::Time before = clock_.Now();
    wall_ += jump;
    for (int i = 1; i <= 59; ++i) {
      Pass(absl::Seconds(1));
      EXPECT_EQ(clock_.Now(), before + absl::Seconds(i));
    }
    wall_ -= jump;
    EXPECT_EQ(clock_.Now(), before + absl::Seconds(59));
    ASSERT_EQ(told_.size(), 2U);
    EXPECT_EQ(told_[0], std::pair(jump, false));
    EXPECT_EQ(told_[1], std::pair(absl::ZeroDuration(), false));
  }
}

TEST_F(SteadiedClockTest, AClockThatStaysThereIsBelieved) {
  wall_ += absl::Hours(24 * 60);
  EXPECT_EQ(clock_.Now(), start_);
  Pass(absl::Seconds(30));
  wall_ += absl::Hours(1);  // again: the minute begins anew
  EXPECT_EQ(clock_.Now(), start_ + absl::Seconds(30));
  Pass(absl::Seconds(59));
  EXPECT_EQ(clock_.Now(), start_ + absl::Seconds(89));
  Pass(absl::Seconds(1));
  EXPECT_EQ(clock_.Now(), wall_);
  Pass(absl::Hours(1));
  EXPECT_EQ(clock_.Now(), wall_);
  ASSERT_EQ(told_.size(), 3U);
  EXPECT_TRUE(told_[2].second);
  EXPECT_EQ(told_[2].first, absl::Hours(24 * 60 + 1));
}

}  // namespace
}  // namespace vantage::execution
