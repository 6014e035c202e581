#include "server/session/memory_account.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>
#include <vector>

namespace vantage::session {
namespace {

TEST(MemoryAccount, LetsNobodyHaveWhatIsNotThere) {
  MemoryAccount account(100);
  auto first = account.Take("", 60);
  ASSERT_TRUE(first.has_value());
  EXPECT_FALSE(account.Take("", 41).has_value());
  auto second = account.Take("", 40);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(account.used(), 100);
  first->Release();
  EXPECT_EQ(account.used(), 40);
  EXPECT_TRUE(account.Take("", 60).has_value());  // and gives it back at once
  EXPECT_EQ(account.used(), 40);
}

// A site that is too large for the whole budget is worked on alone, rather than never.
TEST(MemoryAccount, WhatIsLargerThanEverythingComesAlone) {
  MemoryAccount account(100);
  {
    const auto large = account.Take("", 1000);
    ASSERT_TRUE(large.has_value());
    EXPECT_FALSE(account.Take("", 1).has_value());
  }
  const auto small = account.Take("", 1);
  EXPECT_FALSE(account.Take("", 1000).has_value());
}

TEST(MemoryAccount, NobodyTakesLessThanNothing) {
  MemoryAccount account(100);
  EXPECT_FALSE(account.Take("", -1).has_value());
  EXPECT_FALSE(account.TakeSpare("", -1).has_value());
}

TEST(MemoryAccount, WithoutABudgetEverythingIsLetIn) {
  MemoryAccount account(0);
  const auto first = account.Take("", int64_t{1} << 60);
  EXPECT_TRUE(account.Take("", int64_t{1} << 60).has_value());
}

TEST(MemoryAccount, SaysWhatLacks) {
  MemoryAccount account(100);
  int64_t lacks = 0;
  account.OnShortage([&](const MemoryAccount::Shortage& shortage) { lacks = shortage.lacks; });
  auto held = account.Take("", 90);
  EXPECT_EQ(lacks, 0);
  EXPECT_FALSE(account.Take("", 25).has_value());
  EXPECT_EQ(lacks, 15);
  account.OnNoShortage();
  lacks = 0;
  EXPECT_FALSE(account.Take("", 25).has_value());
  EXPECT_EQ(lacks, 0);
}

// What can be given up is given up, and nobody is refused for it.
TEST(MemoryAccount, WhatAShortageFreesIsThere) {
  MemoryAccount account(100);
  auto spare = account.Take("", 60);
  account.OnShortage([&](const MemoryAccount::Shortage&) { spare.reset(); });
  EXPECT_TRUE(account.Take("", 80).has_value());
  spare = account.Take("", 60);
  auto grows = account.Take("", 30);
  EXPECT_TRUE(grows->Grow(70));
  account.OnNoShortage();
}

// What nobody asked for yet is worth no shortage, and leaves an eighth.
TEST(MemoryAccount, SpareIsWhatNobodyMisses) {
  MemoryAccount account(100);
  int shortages = 0;
  account.OnShortage([&](const MemoryAccount::Shortage&) { ++shortages; });
  auto held = account.Take("", 50);
  EXPECT_FALSE(account.TakeSpare("", 39).has_value());
  auto spare = account.TakeSpare("", 38);
  ASSERT_TRUE(spare.has_value());
  EXPECT_EQ(account.used(), 88);
  spare->Release();
  EXPECT_EQ(account.used(), 50);
  // "b" is refused its share, and comes again.
  auto a = account.Take("a", 30);
  EXPECT_FALSE(account.Take("b", 25).has_value());
  EXPECT_EQ(shortages, 1);
  held->Release();
  EXPECT_FALSE(account.TakeSpare("a", 46).has_value());
  EXPECT_TRUE(account.TakeSpare("a", 45).has_value());
  account.OnNoShortage();
  EXPECT_TRUE(MemoryAccount(0).TakeSpare("", int64_t{1} << 60).has_value());
}

TEST(MemoryAccount, ReservationsMoveWithoutCountingTwice) {
  MemoryAccount account(100);
  MemoryAccount::Reservation reservation = account.Empty("");
  reservation.Set(30);
  MemoryAccount::Reservation other = std::move(reservation);
  EXPECT_EQ(account.used(), 30);
  other = *account.Take("", 10);
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
        auto held = account.Take("", static_cast<int64_t>(random() % 700));
        if (held.has_value() && random() % 2 == 0) held->Set(static_cast<int64_t>(random() % 900));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(account.used(), 0);
}

class MemoryShares : public ::testing::Test {
 protected:
  MemoryAccount account_{800, [this] { return now_; }};
  absl::Duration now_ = absl::Hours(1);
};

TEST_F(MemoryShares, AloneATenantLeavesAnEighth) {
  const auto greedy = account_.Take("greedy", 700);
  ASSERT_TRUE(greedy.has_value());
  EXPECT_FALSE(account_.Take("greedy", 1).has_value());
  EXPECT_TRUE(account_.Take("quiet", 100).has_value());
}

TEST_F(MemoryShares, WhatIsWaitedForIsNotTakenByThoseWhoHaveMoreThanTheirShare) {
  std::vector<MemoryAccount::Reservation> greedy;
  while (auto more = account_.Take("greedy", 50)) greedy.push_back(*std::move(more));
  EXPECT_EQ(account_.used(), 700);
  MemoryAccount::Shortage shortage;
  account_.OnShortage([&](const MemoryAccount::Shortage& refused) { shortage = refused; });
  EXPECT_FALSE(account_.Take("quiet", 200).has_value());
  EXPECT_EQ(shortage.lacks, 100);
  EXPECT_EQ(shortage.tenant, "quiet");
  EXPECT_TRUE(shortage.within_share);
  EXPECT_TRUE(account_.BeyondShare("greedy"));
  EXPECT_FALSE(account_.BeyondShare("quiet"));
  // What is given back is the quiet one's, however often the greedy one asks first.
  greedy.resize(12);
  EXPECT_FALSE(account_.Take("greedy", 50).has_value());
  EXPECT_FALSE(shortage.within_share);
  const auto quiet = account_.Take("quiet", 200);
  ASSERT_TRUE(quiet.has_value());
  account_.OnNoShortage();
}

TEST_F(MemoryShares, WhoDoesNotComeAgainIsNotWaitedFor) {
  auto greedy = account_.Take("greedy", 450);
  auto other = account_.Take("other", 250);
  ASSERT_TRUE(other.has_value());
  EXPECT_FALSE(account_.Take("quiet", 200).has_value());
  other->Release();
  EXPECT_FALSE(account_.Take("greedy", 200).has_value());
  now_ += MemoryAccount::kWaits;
  EXPECT_TRUE(account_.Take("greedy", 200).has_value());
}

TEST_F(MemoryShares, WithinTheirSharesNobodyWaitsForOthers) {
  // Whoever asks how often: each of four gets a quarter at once, in any order.
  std::vector<MemoryAccount::Reservation> all;
  for (const char* tenant : {"a", "b", "c", "d"}) {
    auto mine = account_.Take(tenant, 200);
    ASSERT_TRUE(mine.has_value()) << tenant;
    EXPECT_FALSE(account_.BeyondShare(tenant));
    all.push_back(*std::move(mine));
  }
  all.pop_back();
  // Beyond its share one has to leave an eighth.
  EXPECT_FALSE(account_.Take("a", 101).has_value());
  EXPECT_TRUE(account_.Take("a", 100).has_value());
}

// What will never fit is refused for good, instead of being waited for.
TEST_F(MemoryShares, TheMostIsWhatOneAloneCanHave) {
  const auto model = account_.Take("alone", 1);
  auto scan = account_.Take("alone", 1);
  EXPECT_TRUE(scan->Grow(account_.Most("alone") - 1));
  EXPECT_FALSE(scan->Grow(account_.Most("alone")));
  EXPECT_EQ(account_.Most(""), account_.budget());
}

TEST_F(MemoryShares, WithoutTenantsAllIsThere) {
  EXPECT_TRUE(account_.Take("", 800).has_value());
  EXPECT_EQ(account_.used(), 0);
}

}  // namespace
}  // namespace vantage::session
