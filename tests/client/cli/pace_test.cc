#include "client/cli/pace.h"

#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

using std::chrono::milliseconds;

TEST(PaceTest, TellsRateAndTimeLeftOfTheLastSeconds) {
  Pace pace;
  const Pace::Clock::time_point start{};
  EXPECT_EQ(pace.Of(0, 500e6, start), "0 kB of 500.0 MB");
  EXPECT_EQ(pace.Of(20e6, 500e6, start + milliseconds(200)), "20.0 MB of 500.0 MB");
  EXPECT_EQ(pace.Of(100e6, 500e6, start + milliseconds(1000)),
            "100.0 MB of 500.0 MB, 100.0 MB/s, 4 s left");
  // The link is slow now: a megabyte a second for a minute.
  std::string text;
  for (int second = 2; second <= 60; ++second) {
    text = pace.Of(100e6 + (second - 1) * 1e6, 500e6, start + std::chrono::seconds(second));
  }
  EXPECT_EQ(text, "159.0 MB of 500.0 MB, 1.0 MB/s, 6 min left");
  EXPECT_EQ(pace.Of(500e6, 500e6, start + std::chrono::seconds(61)).find("left"),
            std::string::npos);
}

TEST(PaceTest, WhatBeginsAnewHasNoPaceYet) {
  Pace pace;
  const Pace::Clock::time_point start{};
  pace.Of(0, 10e6, start);
  pace.Of(10e6, 10e6, start + milliseconds(1000));
  EXPECT_EQ(pace.Of(1e6, 10e6, start + milliseconds(1100)), "1.0 MB of 10.0 MB");
  EXPECT_EQ(pace.Of(2e6, 10e6, start + milliseconds(2100)),
            "2.0 MB of 10.0 MB, 1.0 MB/s, 8 s left");
}

}  // namespace
}  // namespace vantage::cli
