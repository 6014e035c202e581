#include "server/execution/strand.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
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

TEST(Strand, WhatAnEndedPoolDroppedKeepsNobodyAlive) {
  // As a session does: it owns the strand, and its operations keep it alive.
  struct Owner {
    std::shared_ptr<Strand> strand;
  };
  std::weak_ptr<Owner> queued;
  std::weak_ptr<Owner> behind;
  std::promise<void> begun;
  {
    PlanningPool pool(1, 2);
    const auto owner = std::make_shared<Owner>();
    owner->strand = std::make_shared<Strand>(pool, pool.NewShare(), 10);
    behind = owner;
    const auto other = std::make_shared<Owner>();
    other->strand = std::make_shared<Strand>(pool, pool.NewShare(), 10);
    queued = other;
    // Runs until the pool has dropped what it had not begun.
    ASSERT_TRUE(owner->strand->TryPost([&](parallel::Parallel&) {
      begun.set_value();
      const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
      while (!queued.expired() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    }));
    ASSERT_TRUE(owner->strand->TryPost([keep = owner](parallel::Parallel&) {}));
    ASSERT_TRUE(other->strand->TryPost([keep = other](parallel::Parallel&) {}));
    begun.get_future().wait();
  }
  EXPECT_TRUE(queued.expired());
  EXPECT_TRUE(behind.expired());
}

}  // namespace
}  // namespace vantage::execution
