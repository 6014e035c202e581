#include "server/web/turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace vantage::web {
namespace {

using ::testing::ElementsAre;

TEST(Turns, SomeAtATimeInTheOrderInWhichTheyCame) {
  Turns turns(2);
  std::vector<int> begun;
  std::vector<Turns::Turn> held;
  for (int i = 0; i < 5; ++i) {
    turns.Wait([&, i](Turns::Turn turn) {
      begun.push_back(i);
      held.push_back(std::move(turn));
    });
  }
  EXPECT_THAT(begun, ElementsAre(0, 1));
  const Turns::Turn first = std::move(held[0]);
  held[0] = nullptr;
  EXPECT_THAT(begun, ElementsAre(0, 1));  // it is still held
  held[1] = nullptr;
  EXPECT_THAT(begun, ElementsAre(0, 1, 2));
  held[2] = nullptr;
  held[3] = nullptr;
  EXPECT_THAT(begun, ElementsAre(0, 1, 2, 3, 4));
}

TEST(Turns, NeverMoreThanAreAllowedOnAnyThreads) {
  Turns turns(3);
  std::atomic<int> at_once{0};
  std::atomic<int> most{0};
  std::atomic<int> done{0};
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 1000; ++k) {
        turns.Wait([&](const Turns::Turn&) {
          const int now = ++at_once;
          int seen = most;
          while (now > seen && !most.compare_exchange_weak(seen, now)) {
          }
          --at_once;
          ++done;
        });
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, 4000);
  EXPECT_LE(most, 3);
}

}  // namespace
}  // namespace vantage::web
