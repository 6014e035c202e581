#include "server/session/memory_account.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>
#include <vector>

namespace vantage::session {
namespace {

TEST(MemoryAccount, LetsNobodyHaveWhatIsNotThere) {
  MemoryAccount account(100);
  auto first = account.Take(60);
  ASSERT_TRUE(first.has_value());
  EXPECT_FALSE(account.Take(41).has_value());
  auto second = account.Take(40);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(account.used(), 100);
  first->Release();
  EXPECT_EQ(account.used(), 40);
  EXPECT_TRUE(account.Take(60).has_value());  // and gives it back at once
  EXPECT_EQ(account.used(), 40);
}

// A site that is too large for the whole budget is worked on alone, rather than never.
TEST(MemoryAccount, WhatIsLargerThanEverythingComesAlone) {
  MemoryAccount account(100);
  {
    const auto large = account.Take(1000);
    ASSERT_TRUE(large.has_value());
    EXPECT_FALSE(account.Take(1).has_value());
  }
  const auto small = account.Take(1);
  EXPECT_FALSE(account.Take(1000).has_value());
}

TEST(MemoryAccount, WithoutABudgetEverythingIsLetIn) {
  MemoryAccount account(0);
  const auto first = account.Take(int64_t{1} << 60);
  EXPECT_TRUE(account.Take(int64_t{1} << 60).has_value());
}

TEST(MemoryAccount, SaysWhatLacks) {
  MemoryAccount account(100);
  int64_t lacks = 0;
  account.OnShortage([&](int64_t bytes) { lacks = bytes; });
  auto held = account.Take(90);
  EXPECT_EQ(lacks, 0);
  EXPECT_FALSE(account.Take(25).has_value());
  EXPECT_EQ(lacks, 15);
  account.OnNoShortage();
  lacks = 0;
  EXPECT_FALSE(account.Take(25).has_value());
  EXPECT_EQ(lacks, 0);
}

TEST(MemoryAccount, ReservationsMoveWithoutCountingTwice) {
  MemoryAccount account(100);
  MemoryAccount::Reservation reservation = account.Empty();
  reservation.Set(30);
  MemoryAccount::Reservation other = std::move(reservation);
  EXPECT_EQ(account.used(), 30);
  other = *account.Take(10);
  EXPECT_EQ(account.used(), 10);
  other.Set(70);
  EXPECT_EQ(account.used(), 70);
  MemoryAccount::Reservation nobodys;
  nobodys.Set(5);  // harmless: of no account
  EXPECT_EQ(account.used(), 70);
}

TEST(MemoryAccount, IsEvenAfterManyThreads) {
  MemoryAccount account(1000);
  std::vector<std::thread> threads;
  for (unsigned seed = 0; seed < 4; ++seed) {
    threads.emplace_back([&account, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 20'000; ++i) {
        auto held = account.Take(static_cast<int64_t>(random() % 700));
        if (held.has_value() && random() % 2 == 0) held->Set(static_cast<int64_t>(random() % 900));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(account.used(), 0);
}

}  // namespace
}  // namespace vantage::session
