#include "server/auth/rate_limits.h"

#include <gtest/gtest.h>

#include <string>

namespace vantage::auth {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr RateLimits::Time kStart{seconds(1000)};

// Over a long time as many as the rate says, however they come, plus what was saved at first.
TEST(RateLimits, LetInAsManyAsTheRateSays) {
  for (const milliseconds every : {milliseconds(1), milliseconds(7), milliseconds(90)}) {
    RateLimits limits(10, 5);
    int admitted = 0;
    for (milliseconds at{0}; at < seconds(100); at += every) {
      if (limits.Take("a", kStart + at) == absl::ZeroDuration()) ++admitted;
    }
    EXPECT_GE(admitted, 999) << every.count();
    EXPECT_LE(admitted, 1006) << every.count();
  }
}

TEST(RateLimits, WhoeverWaitsAsToldIsLetIn) {
  RateLimits limits(4, 2);
  RateLimits::Time now = kStart;
  for (int i = 0; i < 50; ++i) {
    const absl::Duration wait = limits.Take("a", now);
    if (wait == absl::ZeroDuration()) continue;
    EXPECT_LE(wait, absl::Milliseconds(250));
    now += absl::ToChronoNanoseconds(wait) + std::chrono::nanoseconds(1000);
    EXPECT_EQ(limits.Take("a", now), absl::ZeroDuration());
  }
}

TEST(RateLimits, OneCallerDoesNotSpendAnothersCalls) {
  RateLimits limits(1, 3);
  for (int i = 0; i < 100; ++i) limits.Take("greedy", kStart);
  EXPECT_GT(limits.Take("greedy", kStart), absl::ZeroDuration());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(limits.Take("modest", kStart), absl::ZeroDuration());
}

TEST(RateLimits, MemoryIsBoundedWhateverKeysCome) {
  RateLimits limits(1, 2, 100);
  for (int i = 0; i < 100'000; ++i) limits.Take("key" + std::to_string(i), kStart);
  EXPECT_LE(limits.keys(), 100U);
  // Those beyond share a bucket, and are limited too.
  EXPECT_GT(limits.Take("yet another", kStart), absl::ZeroDuration());
  // After a rest there is room for new ones.
  EXPECT_EQ(limits.Take("yet another", kStart + seconds(60)), absl::ZeroDuration());
  EXPECT_LE(limits.keys(), 2U);
}

TEST(RateLimits, ZeroIsNoLimit) {
  RateLimits limits(0, 1);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(limits.Take("a", kStart), absl::ZeroDuration());
  EXPECT_EQ(limits.keys(), 0U);
}

}  // namespace
}  // namespace vantage::auth
