#include "core/parallel/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace vantage::parallel {
namespace {

class ThreadPoolTest : public testing::TestWithParam<int> {};

TEST_P(ThreadPoolTest, CallsEveryIndexOnce) {
  ThreadPool pool(GetParam());
  for (const size_t count : {0u, 1u, 2u, 7u, 10'000u}) {
    std::vector<std::atomic<int>> calls(count);
    pool.For(count, [&](size_t i) { calls[i].fetch_add(1); });
    for (size_t i = 0; i < count; ++i) EXPECT_EQ(calls[i].load(), 1) << i << " of " << count;
  }
}

TEST_P(ThreadPoolTest, LoopsFromSeveralThreadsDoNotMix) {
  ThreadPool pool(GetParam());
  std::vector<std::thread> callers;
  std::vector<std::atomic<long>> sums(4);
  for (size_t caller = 0; caller < sums.size(); ++caller) {
    callers.emplace_back([&, caller] {
      for (int round = 0; round < 50; ++round) {
        pool.For(100, [&](size_t i) { sums[caller].fetch_add(static_cast<long>(i)); });
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  for (const std::atomic<long>& sum : sums) EXPECT_EQ(sum.load(), 50 * 4950);
}

TEST_P(ThreadPoolTest, LoopsNest) {
  ThreadPool pool(GetParam());
  std::atomic<int> calls{0};
  pool.For(8, [&](size_t) { pool.For(8, [&](size_t) { calls.fetch_add(1); }); });
  EXPECT_EQ(calls.load(), 64);
}

INSTANTIATE_TEST_SUITE_P(Widths, ThreadPoolTest, testing::Values(1, 2, 8));

}  // namespace
}  // namespace vantage::parallel
