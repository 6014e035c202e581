// Nobody takes all the places that there are for calls.
#include "server/rpc/call/call_counts.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "server/contract/error.h"

namespace vantage::rpc {
namespace {

constexpr int kMost = 64;

// How many of a kind are let in, one after the other, until one is not.
int Fill(CallCounts& counts, const std::optional<std::string>& tenant, bool stream) {
  int in = 0;
  while (counts.Take(tenant, stream, kMost).ok()) ++in;
  return in;
}

TEST(CallCountsTest, StreamsLeaveRoomForCalls) {
  CallCounts counts;
  EXPECT_EQ(Fill(counts, std::nullopt, true), 48);
  const absl::Status busy = counts.Take(std::nullopt, true, kMost);
  EXPECT_EQ(contract::ReasonOf(busy), "SERVER_BUSY");
  EXPECT_EQ(Fill(counts, std::nullopt, false), 16);
  EXPECT_EQ(contract::ReasonOf(counts.Take(std::nullopt, false, kMost)), "SERVER_BUSY");
  EXPECT_EQ(counts.total(), kMost);
}

TEST(CallCountsTest, ATenantHasNoMoreThanIsLeftForOthers) {
  CallCounts counts;
  EXPECT_EQ(Fill(counts, "greedy", true), 24);
  EXPECT_EQ(contract::ReasonOf(counts.Take("greedy", true, kMost)), "TENANT_BUSY");
  EXPECT_EQ(Fill(counts, "second", true), 12);
  EXPECT_EQ(Fill(counts, "third", true), 6);
  EXPECT_EQ(Fill(counts, "quiet", false), 11);
  EXPECT_TRUE(counts.Take("last", false, kMost).ok());
}

TEST(CallCountsTest, WhatEndsMakesRoom) {
  CallCounts counts;
  EXPECT_EQ(Fill(counts, "one", false), 32);
  counts.GiveBack("one", false);
  EXPECT_EQ(counts.total(), 31);
  EXPECT_EQ(Fill(counts, "one", false), 1);
  for (int i = 0; i < 32; ++i) counts.GiveBack("one", false);
  EXPECT_EQ(counts.total(), 0);
  EXPECT_EQ(Fill(counts, "two", false), 32);
}

}  // namespace
}  // namespace vantage::rpc
