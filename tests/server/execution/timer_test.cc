#include "server/execution/timer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

#include "server/execution/task_pool.h"

namespace vantage::execution {
namespace {

TEST(Timer, CallsInOrderOfTimeAndNotWhatWasCancelled) {
  Timer timer;
  std::vector<int> order;
  std::promise<void> last;
  const auto now = Timer::Clock::now();
  using std::chrono::milliseconds;
  timer.At(now + milliseconds(30), [&] {
    order.push_back(3);
    last.set_value();
  });
  timer.At(now + milliseconds(10), [&] { order.push_back(1); });
  const Timer::Id cancelled = timer.At(now + milliseconds(20), [&] { order.push_back(2); });
  timer.Cancel(cancelled);
  last.get_future().wait();
  EXPECT_EQ(order, (std::vector<int>{1, 3}));
  timer.Cancel(cancelled);  // harmless
}

TEST(Timer, StoppedItCallsNothingMore) {
  Timer timer;
  std::promise<void> begun;
  std::promise<void> release;
  std::shared_future<void> released = release.get_future().share();
  std::atomic<bool> ended{false};
  std::atomic<bool> late{false};
  const auto now = Timer::Clock::now();
  timer.At(now, [&, released] {
    begun.set_value();
    released.wait();
    ended = true;
  });
  timer.At(now + std::chrono::milliseconds(1), [&] { late = true; });
  begun.get_future().wait();
  std::thread stop([&] {
    timer.Stop();
    EXPECT_TRUE(ended);  // it waited for the call that ran
  });
  release.set_value();
  stop.join();
  const bool before = late;
  timer.At(now, [&] { late = true; });
  timer.Stop();  // harmless
  EXPECT_EQ(late, before);
}

TEST(TaskPool, RefusesWhenFullAndRunsWhatItTook) {
  std::atomic<int> ran{0};
  {
    TaskPool pool(1, 2);
    std::promise<void> begun;
    std::promise<void> release;
    std::shared_future<void> released = release.get_future().share();
    ASSERT_TRUE(pool.TryPost([&begun, released] {
      begun.set_value();
      released.wait();
    }));
    begun.get_future().wait();
    EXPECT_TRUE(pool.TryPost([&] { ++ran; }));
    EXPECT_TRUE(pool.TryPost([&] { ++ran; }));
    EXPECT_FALSE(pool.TryPost([&] { ran += 100; }));
    pool.Post([&] { ++ran; });  // a step of admitted work is never refused
    release.set_value();
  }
  EXPECT_EQ(ran, 3);
}

}  // namespace
}  // namespace vantage::execution
