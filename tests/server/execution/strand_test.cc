#include "server/execution/strand.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

namespace vantage::execution {
namespace {

TEST(Strand, RunsInOrderAndOneAtATime) {
  PlanningPool pool(3, 6);
  const auto strand = std::make_shared<Strand>(pool, pool.NewShare(), 1000);
  std::atomic<int> running{0};
  bool overlapped = false;
  std::vector<int> order;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(strand->TryPost([&, i](parallel::Parallel&) {
      if (++running > 1) overlapped = true;
      order.push_back(i);
      --running;
    }));
  }
  strand->WaitUntilIdle();
  EXPECT_FALSE(overlapped);
  ASSERT_EQ(order.size(), 200U);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(order[static_cast<size_t>(i)], i);
}

TEST(Strand, RefusesBeyondItsCapacityAndAfterClosing) {
  PlanningPool pool(1, 2);
  const auto strand = std::make_shared<Strand>(pool, pool.NewShare(), 2);
  std::promise<void> begun;
  std::promise<void> release;
  ASSERT_TRUE(strand->TryPost([&](parallel::Parallel&) {
    begun.set_value();
    release.get_future().wait();
  }));
  begun.get_future().wait();
  std::atomic<int> ran{0};
  EXPECT_TRUE(strand->TryPost([&](parallel::Parallel&) { ++ran; }));
  EXPECT_TRUE(strand->TryPost([&](parallel::Parallel&) { ++ran; }));
  EXPECT_FALSE(strand->TryPost([&](parallel::Parallel&) { ++ran; }));
  strand->Close();
  EXPECT_FALSE(strand->TryPost([&](parallel::Parallel&) { ++ran; }));
  release.set_value();
  strand->WaitUntilIdle();
  EXPECT_EQ(ran, 0);
}

}  // namespace
}  // namespace vantage::execution
