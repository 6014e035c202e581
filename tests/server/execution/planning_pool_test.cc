#include "server/execution/planning_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <latch>
#include <memory>
#include <new>
#include <thread>
#include <utility>
#include <vector>

namespace vantage::execution {
namespace {

class PlanningPoolTest : public testing::TestWithParam<int> {};

TEST_P(PlanningPoolTest, EveryIndexRunsOnceAlsoNested) {
  PlanningPool pool(GetParam(), 4);
  std::vector<std::atomic<int>> counts(500);
  std::promise<void> done;
  pool.Submit(pool.NewShare(), JobPriority::kPlan, [&](parallel::Parallel& parallel) {
    parallel.For(50, [&](size_t i) { parallel.For(10, [&](size_t j) { ++counts[i * 10 + j]; }); });
    done.set_value();
  });
  done.get_future().wait();
  for (const std::atomic<int>& count : counts) EXPECT_EQ(count, 1);
}

TEST_P(PlanningPoolTest, ManyJobsOfManySessionsAllRun) {
  PlanningPool pool(GetParam(), 3);
  constexpr int kJobs = 60;
  std::atomic<int> sum{0};
  std::latch done(kJobs);
  for (int i = 0; i < kJobs; ++i) {
    pool.Submit(pool.NewShare(), static_cast<JobPriority>(i % 3),
                [&](parallel::Parallel& parallel) {
                  std::atomic<int> own{0};
                  parallel.For(20, [&](size_t) { ++own; });
                  sum += own;
                  done.count_down();
                });
  }
  done.wait();
  EXPECT_EQ(sum, kJobs * 20);
}

INSTANTIATE_TEST_SUITE_P(Slots, PlanningPoolTest, testing::Values(1, 2, 3, 8));

TEST(PlanningPool, NeverMoreBodiesThanSlots) {
  PlanningPool pool(2, 8);
  std::atomic<int> running{0};
  std::atomic<int> most{0};
  std::latch done(6);
  for (int job = 0; job < 6; ++job) {
    pool.Submit(pool.NewShare(), JobPriority::kPlan, [&](parallel::Parallel& parallel) {
      parallel.For(200, [&](size_t) {
        const int now = ++running;
        int seen = most;
        while (seen < now && !most.compare_exchange_weak(seen, now)) {
        }
        std::this_thread::yield();
        --running;
      });
      done.count_down();
    });
  }
  done.wait();
  EXPECT_LE(most, 2);
}

// With one slot, what waits goes in order of priority within a session.
TEST(PlanningPool, InteractiveBeforeModelBeforePlan) {
  PlanningPool pool(1, 2);
  const auto share = pool.NewShare();
  std::promise<void> begun;
  std::promise<void> release;
  std::vector<int> order;
  std::latch done(4);
  pool.Submit(share, JobPriority::kModel, [&](parallel::Parallel&) {
    begun.set_value();
    release.get_future().wait();
    done.count_down();
  });
  begun.get_future().wait();
  // The second job thread takes the first of these and waits for the slot; it is the one that the
  // order of submission decides.
  for (const JobPriority priority :
       {JobPriority::kInteractive, JobPriority::kPlan, JobPriority::kModel}) {
    pool.Submit(share, priority, [&, priority](parallel::Parallel&) {
      order.push_back(static_cast<int>(priority));
      done.count_down();
    });
  }
  release.set_value();
  done.wait();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
}

// A session that computes without pause does not keep another from its share: the greedy job ends
// only when the late one has run, which takes the one slot changing hands between bodies.
TEST(PlanningPool, ASessionThatComesLateGetsTheSlotBetweenBodies) {
  PlanningPool pool(1, 4);
  std::atomic<bool> late_ran{false};
  std::promise<void> begun;
  std::latch done(2);
  pool.Submit(pool.NewShare(), JobPriority::kInteractive, [&](parallel::Parallel& parallel) {
    begun.set_value();
    while (!late_ran) {
      parallel.For(1000, [](size_t) {});
    }
    done.count_down();
  });
  begun.get_future().wait();
  pool.Submit(pool.NewShare(), JobPriority::kPlan, [&](parallel::Parallel&) {
    late_ran = true;
    done.count_down();
  });
  done.wait();
  EXPECT_TRUE(late_ran);
}

// Two sessions that both want everything, one with three jobs and one with one: when the first has
// used a tenth of a second, the other has had about as much.
TEST(PlanningPool, SharesAreBySessionNotByJob) {
  PlanningPool pool(1, 8);
  const auto three = pool.NewShare();
  const auto one = pool.NewShare();
  std::atomic<bool> stop{false};
  std::latch begun(4);
  std::latch done(4);
  const auto job = [&](parallel::Parallel& parallel) {
    begun.count_down();
    while (!stop) parallel.For(100, [](size_t) {});
    done.count_down();
  };
  for (int i = 0; i < 3; ++i) pool.Submit(three, JobPriority::kPlan, job);
  pool.Submit(one, JobPriority::kPlan, job);
  begun.wait();
  const double three_before = pool.Used(*three);
  const double one_before = pool.Used(*one);
  while (pool.Used(*three) - three_before < 0.4) std::this_thread::yield();
  const double ratio = (pool.Used(*one) - one_before) / (pool.Used(*three) - three_before);
  stop = true;
  done.wait();
  // By job it would be a third; slices of 2 ms, and whatever else the machine does, blur it a
  // little.
  EXPECT_GT(ratio, 0.7);
  EXPECT_LT(ratio, 1.4);
}

// What has not begun when the pool ends is dropped, with what it holds.
TEST(PlanningPool, DropsWhatHasNotBegun) {
  auto held = std::make_shared<int>(1);
  std::weak_ptr<int> watch = held;
  {
    PlanningPool pool(1, 2);
    const auto share = pool.NewShare();
    std::promise<void> begun;
    std::promise<void> release;
    std::shared_future<void> released = release.get_future().share();
    pool.Submit(share, JobPriority::kPlan, [&, released](parallel::Parallel&) {
      begun.set_value();
      released.wait();
    });
    begun.get_future().wait();
    for (int i = 0; i < 20; ++i) {
      pool.Submit(share, JobPriority::kPlan,
                  [held, released](parallel::Parallel&) { released.wait(); });
    }
    held.reset();
    release.set_value();
  }
  EXPECT_TRUE(watch.expired());
}

// What has begun is finished, by its own thread alone: the helpers are gone by then (the sanitizers
// tell if one is given work all the same).
TEST(PlanningPool, AJobThatRunsAtTheEndIsFinished) {
  std::promise<void> begun;
  std::promise<void> ending;
  std::atomic<int> bodies{0};
  {
    PlanningPool pool(4, 2);
    pool.Submit(pool.NewShare(), JobPriority::kInteractive, [&](parallel::Parallel& parallel) {
      begun.set_value();
      ending.get_future().wait();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      for (int i = 0; i < 20; ++i) parallel.For(8, [&](size_t) { ++bodies; });
    });
    begun.get_future().wait();
    ending.set_value();
  }
  EXPECT_EQ(bodies, 160);
}

// There may be no memory for a body, on whatever thread it runs.
TEST_P(PlanningPoolTest, WhatIsThrownInALoopArrivesInTheJobAndThePoolGoesOn) {
  PlanningPool pool(GetParam(), 4);
  const auto share = pool.NewShare();
  constexpr size_t kOuter = 1000;
  constexpr size_t kInner = 10;
  constexpr int kThrows = 200;
  std::promise<bool> caught;
  std::atomic<int> begun{0};
  pool.Submit(share, JobPriority::kModel, [&](parallel::Parallel& parallel) {
    try {
      parallel.For(kOuter, [&](size_t) {
        parallel.For(kInner, [&](size_t) {
          const int order = ++begun;
          if (order == kThrows) throw std::bad_alloc();
          // What throws may itself have to wait for a core; the others must not be done before.
          if (order > kThrows) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
      });
      caught.set_value(false);
    } catch (const std::bad_alloc&) {
      caught.set_value(true);
    }
  });
  EXPECT_TRUE(caught.get_future().get());
  EXPECT_LT(begun, static_cast<int>(kOuter * kInner));
  // A job that lets it pass is over, and no more.
  pool.Submit(share, JobPriority::kModel, [](parallel::Parallel&) { throw std::bad_alloc(); });
  std::promise<void> next;
  pool.Submit(share, JobPriority::kModel, [&](parallel::Parallel& parallel) {
    parallel.For(10, [](size_t) {});
    next.set_value();
  });
  next.get_future().wait();
}

// Runs until told to end, in bodies that are over at once: where it can be preempted.
class LongPlan {
 public:
  uint64_t Submit(PlanningPool& pool, std::shared_ptr<PlanningPool::Share> share,
                  double seconds = 0) {
    return pool.Submit(
        std::move(share), JobPriority::kPlan,
        [this](parallel::Parallel& parallel) {
          ++begun;
          while (!ended) parallel.For(4, [](size_t) { std::this_thread::yield(); });
        },
        seconds);
  }
  std::atomic<int> begun{0};
  std::atomic<bool> ended{false};
};

TEST(PlanningPool, LongPlansOfOneTenantKeepNobodyElseWaiting) {
  LongPlan greedy;
  PlanningPool pool(2, 8, std::chrono::milliseconds(5));
  for (int session = 0; session < 2; ++session) {
    const auto share = pool.NewShare(1.0, "greedy");
    for (int i = 0; i < 8; ++i) greedy.Submit(pool, share);
  }
  constexpr int kPlaces = 6;  // three quarters of 8
  while (pool.load().running < kPlaces) std::this_thread::yield();
  // Others begin at once, and so does what is no plan.
  for (const char* quiet : {"a", "b", "c", "d"}) {
    LongPlan own;
    own.Submit(pool, pool.NewShare(1.0, quiet));
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (own.begun == 0 && std::chrono::steady_clock::now() < until) std::this_thread::yield();
    EXPECT_EQ(own.begun, 1);
    std::promise<void> merged;
    pool.Submit(pool.NewShare(1.0, quiet), JobPriority::kModel,
                [&](parallel::Parallel&) { merged.set_value(); });
    EXPECT_EQ(merged.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready);
    own.ended = true;
    while (pool.load().running > kPlaces) std::this_thread::yield();
  }
  EXPECT_EQ(pool.load().running, kPlaces);
  greedy.ended = true;
}

// Merges of many sessions take every place there is; who has none under way, and what is short,
// does not wait for one of them to end.
TEST(PlanningPool, MergesOfOneTenantKeepNobodyElseWaiting) {
  std::atomic<bool> ended{false};
  std::atomic<int> merging{0};
  PlanningPool pool(2, 8);
  const auto merge = [&](parallel::Parallel& parallel) {
    ++merging;
    while (!ended) parallel.For(4, [](size_t) { std::this_thread::yield(); });
  };
  std::vector<std::shared_ptr<PlanningPool::Share>> busy;
  for (int i = 0; i < 20; ++i) {
    busy.push_back(pool.NewShare(1.0, "busy"));
    pool.Submit(busy.back(), JobPriority::kModel, merge);
  }
  while (merging < 8) std::this_thread::yield();
  const auto runs = [&](const std::shared_ptr<PlanningPool::Share>& share, JobPriority priority) {
    auto done = std::make_shared<std::promise<void>>();
    pool.Submit(share, priority, [done](parallel::Parallel&) { done->set_value(); });
    return done->get_future().wait_for(std::chrono::seconds(20)) == std::future_status::ready;
  };
  for (const char* quiet : {"a", "b", ""}) {
    const auto share = pool.NewShare(1.0, quiet);
    EXPECT_TRUE(runs(share, JobPriority::kPlan)) << quiet;
    EXPECT_TRUE(*quiet == 0 || runs(share, JobPriority::kModel)) << quiet;
  }
  EXPECT_TRUE(runs(busy.front(), JobPriority::kInteractive));
  // The places are as many as ever for those who have them all.
  EXPECT_EQ(merging, 8);
  ended = true;
}

// Of sessions that are nobody's as of one tenant's, while another's begins at once.
TEST(PlanningPool, PlansTakeTurns) {
  for (const char* owner : {"", "one"}) {
    // They outlive the pool, whose end waits for them.
    LongPlan first;
    LongPlan others;
    LongPlan elsewhere;
    PlanningPool pool(2, 8);
    first.Submit(pool, pool.NewShare(1.0, owner));
    while (first.begun == 0) std::this_thread::yield();
    std::vector<uint64_t> waiting;
    waiting.reserve(3);
    for (int i = 0; i < 3; ++i) {
      waiting.push_back(others.Submit(pool, pool.NewShare(1.0, owner), 0.5));
    }
    elsewhere.Submit(pool, pool.NewShare(1.0, "another"));
    while (elsewhere.begun == 0) std::this_thread::yield();
    for (size_t i = 0; i < waiting.size(); ++i) {
      const auto place = pool.PlaceOf(waiting[i]);
      ASSERT_TRUE(place.has_value());
      EXPECT_EQ(place->ahead, i);
      EXPECT_GT(place->seconds, 0.5 * static_cast<double>(i));
      EXPECT_LE(place->seconds, 0.5 * static_cast<double>(i) + 2);
    }
    EXPECT_EQ(others.begun, 0);
    pool.Hurry(waiting[1]);
    while (others.begun < 1) std::this_thread::yield();
    EXPECT_FALSE(pool.PlaceOf(waiting[1]).has_value());
    EXPECT_EQ(pool.PlaceOf(waiting[2])->ahead, 1u);
    EXPECT_EQ(others.begun, 1);
    others.ended = true;
    first.ended = elsewhere.ended = true;
    while (others.begun < 3) std::this_thread::yield();
    EXPECT_FALSE(pool.PlaceOf(waiting[0]).has_value());
    EXPECT_FALSE(pool.PlaceOf(12345).has_value());
  }
}

TEST(PlanningPool, ALongPlanHasATurnAndThenGoesOnBesideOthers) {
  LongPlan first;
  LongPlan second;
  PlanningPool pool(2, 8, std::chrono::milliseconds(50));
  first.Submit(pool, pool.NewShare());
  second.Submit(pool, pool.NewShare());
  const auto began = std::chrono::steady_clock::now();
  // Jobs that come and go take the threads that wait for the turn.
  while (second.begun == 0 && std::chrono::steady_clock::now() < began + std::chrono::seconds(20)) {
    std::promise<void> merged;
    pool.Submit(pool.NewShare(), JobPriority::kModel,
                [&](parallel::Parallel&) { merged.set_value(); });
    merged.get_future().wait();
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  EXPECT_EQ(second.begun, 1);
  EXPECT_EQ(first.begun, 1);
  first.ended = second.ended = true;
}

// Computes for some milliseconds, in small bodies.
void Work(parallel::Parallel& parallel, int milliseconds, std::atomic<int>& done) {
  parallel.For(static_cast<size_t>(milliseconds), [&](size_t) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    while (std::chrono::steady_clock::now() < end) {
    }
    ++done;
  });
}

// A merge of another session would have half of the time otherwise.
TEST(PlanningPool, APlanInItsTurnGoesBeforeMergesOfThoseItTakesTurnsWith) {
  for (const char* owner : {"", "one"}) {
    std::atomic<int> merging{0};
    std::atomic<int> planning{0};
    int merged_meanwhile = 0;
    std::latch done(2);
    PlanningPool pool(1, 8);
    pool.Submit(pool.NewShare(1.0, owner), JobPriority::kModel, [&](parallel::Parallel& parallel) {
      Work(parallel, 400, merging);
      done.count_down();
    });
    while (merging < 20) std::this_thread::yield();
    pool.Submit(pool.NewShare(1.0, owner), JobPriority::kPlan, [&](parallel::Parallel& parallel) {
      const int before = merging;
      Work(parallel, 200, planning);
      merged_meanwhile = merging - before;
      done.count_down();
    });
    done.wait();
    EXPECT_LT(merged_meanwhile, 50);
  }
}

// A plan that is over its time ends before merges that go on; it has its turn to pay back later.
TEST(PlanningPool, APlanThatIsOverItsTimeIsFinished) {
  std::atomic<int> merging{0};
  std::atomic<int> planning{0};
  std::atomic<int> merged_meanwhile{0};
  std::latch done(2);
  PlanningPool pool(1, 8, std::chrono::milliseconds(150));
  pool.Submit(pool.NewShare(), JobPriority::kModel, [&](parallel::Parallel& parallel) {
    Work(parallel, 400, merging);
    done.count_down();
  });
  while (merging < 20) std::this_thread::yield();
  constexpr double kMeant = 0.1;  // s
  pool.Submit(
      pool.NewShare(), JobPriority::kPlan,
      [&](parallel::Parallel& parallel) {
        const int before = merging;
        Work(parallel, 250, planning);
        merged_meanwhile = merging - before;
        done.count_down();
      },
      kMeant);
  done.wait();
  EXPECT_LT(merged_meanwhile, 40);
}

// Who plans again and again keeps no merge waiting.
TEST(PlanningPool, NoTurnBeginsWhileAMergeIsUnderWayThatHasHadLess) {
  std::atomic<int> planned{0};
  std::atomic<int> merged{0};
  std::atomic<int> merged_at_second{-1};
  std::latch done(3);
  PlanningPool pool(1, 8);
  const auto planner = pool.NewShare();
  std::promise<void> begun;
  pool.Submit(planner, JobPriority::kPlan, [&](parallel::Parallel& parallel) {
    begun.set_value();
    Work(parallel, 200, planned);
    done.count_down();
  });
  begun.get_future().wait();
  pool.Submit(pool.NewShare(), JobPriority::kModel, [&](parallel::Parallel& parallel) {
    Work(parallel, 100, merged);
    done.count_down();
  });
  pool.Submit(planner, JobPriority::kPlan, [&](parallel::Parallel&) {
    merged_at_second = merged.load();
    done.count_down();
  });
  done.wait();
  EXPECT_EQ(merged_at_second, 100);
}

// What a person waits for is short; it does not wait for the turn's end.
TEST(PlanningPool, InteractiveWorkDoesNotWaitForTheEndOfATurn) {
  std::atomic<int> planned{0};
  std::atomic<int> planned_at_answer{-1};
  std::latch done(2);
  PlanningPool pool(1, 8);
  pool.Submit(pool.NewShare(), JobPriority::kPlan, [&](parallel::Parallel& parallel) {
    Work(parallel, 400, planned);
    done.count_down();
  });
  while (planned < 50) std::this_thread::yield();
  pool.Submit(pool.NewShare(), JobPriority::kInteractive, [&](parallel::Parallel&) {
    planned_at_answer = planned.load();
    done.count_down();
  });
  done.wait();
  EXPECT_LT(planned_at_answer, 300);
}

TEST(PlanningPool, TenantsHaveEqualTimeHoweverManySessionsTheyHave) {
  PlanningPool pool(1, 8);
  std::vector<std::shared_ptr<PlanningPool::Share>> many(4);
  for (auto& share : many) share = pool.NewShare(1.0, "many");
  const auto one = pool.NewShare(1.0, "one");
  std::atomic<bool> ended{false};
  std::latch done(5);
  const auto work = [&](parallel::Parallel& parallel) {
    while (!ended) {
      parallel.For(1, [](size_t) {
        const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
        while (std::chrono::steady_clock::now() < until) {
        }
      });
    }
    done.count_down();
  };
  for (const auto& share : many) pool.Submit(share, JobPriority::kModel, work);
  pool.Submit(one, JobPriority::kModel, work);
  while (pool.Used(*one) < 0.3) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  double used = 0;
  for (const auto& share : many) used += pool.Used(*share);
  ended = true;
  done.wait();
  EXPECT_GT(used, 0.2);
  EXPECT_LT(used, 0.45);
}

}  // namespace
}  // namespace vantage::execution
