#include "core/cover/choose_stations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stop_token>
#include <string>
#include <utility>

#include "absl/strings/match.h"

#include "tests/core/cover/random_cover.h"

namespace vantage::cover {
namespace {

parallel::Budget Work(uint64_t work) {
  parallel::Budget budget;
  budget.work_limit = work;
  return budget;
}

// A third anchored, a third free, a third so loosely linked that they fall into groups.
RandomCover Small(uint64_t seed) {
  RandomCover of{seed};
  of.anchored = seed % 3 == 0 ? 0.2 : 0;
  of.links = seed % 3 == 1 ? 0.12 : 0.35;
  of.covers = 0.12 + 0.04 * static_cast<double>(seed % 5);
  return of;
}

TEST(ChooseFewest, IsTheFewestOfAllChoices) {
  int proven = 0;
  int solved = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    const CoverProblem problem = MakeRandomCover(Small(seed));
    double whole = 0;
    for (const double weight : problem.weights) whole += weight;
    const double goal = (0.4 + 0.1 * static_cast<double>(seed % 4)) * whole;
    const ByTrying truth = TryAll(problem, goal);
    const auto fewest = ChooseFewest(problem, goal, parallel::Budget::Unlimited());
    ASSERT_TRUE(fewest.ok()) << fewest.status();
    const std::vector<uint32_t>& stations = fewest->cover.stations;
    EXPECT_TRUE(EachRegisters(problem, stations)) << "seed " << seed;
    EXPECT_NEAR(fewest->cover.weight, WeightOf(problem, stations), 1e-9);
    EXPECT_EQ(fewest->complete, truth.fewest.has_value()) << "seed " << seed;
    EXPECT_LE(fewest->least, stations.size()) << "seed " << seed;
    if (!truth.fewest) {
      // All that can be had.
      EXPECT_NEAR(fewest->cover.weight, truth.best.back(), 1e-9) << "seed " << seed;
      continue;
    }
    EXPECT_EQ(stations.size(), *truth.fewest) << "seed " << seed;
    EXPECT_GE(fewest->cover.weight, goal - 1e-9 * whole) << "seed " << seed;
    EXPECT_LE(fewest->least, *truth.fewest) << "seed " << seed;
    ++solved;
    if (fewest->least == *truth.fewest) ++proven;
  }
  EXPECT_GE(solved, 15);
  EXPECT_GE(proven, solved / 2);
}

// The bound does not know of links, so it must hold for choices that do not hang together.
TEST(ChooseFewest, BoundHoldsForChoicesThatNeedNotHangTogether) {
  for (uint64_t seed = 1; seed <= 25; ++seed) {
    RandomCover of{seed};
    of.links = 1;
    of.anchored = 0;
    of.covers = 0.1 + 0.03 * static_cast<double>(seed % 4);
    const CoverProblem problem = MakeRandomCover(of);
    double whole = 0;
    for (const double weight : problem.weights) whole += weight;
    const double goal = 0.6 * whole;
    const ByTrying truth = TryAll(problem, goal);
    if (truth.fewest_apart == 0) continue;
    const auto fewest = ChooseFewest(problem, goal, parallel::Budget::Unlimited());
    ASSERT_TRUE(fewest.ok()) << fewest.status();
    EXPECT_LE(fewest->least, truth.fewest_apart) << "seed " << seed;
    EXPECT_GE(fewest->least + 1, truth.fewest_apart) << "seed " << seed;
  }
}

TEST(ChooseFewest, GoesThroughStationsThatOnlyLink) {
  // A corridor of three that see nothing leads to the one that sees everything.
  CoverProblem problem;
  problem.weights = {1, 1, 1};
  problem.covers = {{1}, {0}, {0}, {0}, {7}};
  problem.links = {{1}, {0, 2}, {1, 3}, {2, 4}, {3}};
  problem.anchored = {0};
  const auto fewest = ChooseFewest(problem, 3, parallel::Budget::Unlimited());
  ASSERT_TRUE(fewest.ok()) << fewest.status();
  EXPECT_EQ(fewest->cover.stations, (std::vector<uint32_t>{0, 1, 2, 3, 4}));
  problem.anchored = {};
  const auto free = ChooseFewest(problem, 3, parallel::Budget::Unlimited());
  ASSERT_TRUE(free.ok()) << free.status();
  EXPECT_EQ(free->cover.stations, std::vector<uint32_t>{4});
  EXPECT_EQ(free->least, 1u);
}

TEST(ChooseFewest, IsTheSameWithTheSameWorkAndNoWorseWithMore) {
  const CoverProblem problem = MakeRooms(3, 12, 160, 1500);
  const double goal = 0.95 * ChooseBest(problem, 1000, Work(0))->weight;
  size_t before = SIZE_MAX;
  size_t bound_before = 0;
  size_t first = 0;
  for (const uint64_t work : {0ULL, 5'000'000ULL, 50'000'000ULL, 200'000'000ULL}) {
    const auto once = ChooseFewest(problem, goal, Work(work));
    const auto again = ChooseFewest(problem, goal, Work(work));
    ASSERT_TRUE(once.ok()) << once.status();
    EXPECT_EQ(once->cover.stations, again->cover.stations) << work;
    EXPECT_EQ(once->least, again->least);
    EXPECT_LE(once->cover.stations.size(), before) << work;
    EXPECT_GE(once->least, bound_before) << work;
    EXPECT_LE(once->least, once->cover.stations.size());
    EXPECT_TRUE(once->complete);
    EXPECT_TRUE(EachRegisters(problem, once->cover.stations));
    EXPECT_GE(WeightOf(problem, once->cover.stations), goal - 1e-9);
    if (first == 0) first = once->cover.stations.size();
    before = once->cover.stations.size();
    bound_before = once->least;
  }
  EXPECT_LT(before, first) << "searching brought nothing beyond greed";
}

TEST(ChooseFewest, AnswersAtOnceWhenItIsTooLateAndNotWhenItIsCancelled) {
  const CoverProblem problem = MakeRooms(4, 16, 400, 4000);
  std::stop_source stop;
  stop.request_stop();
  parallel::Budget cancelled;
  cancelled.cancelled = stop.get_token();
  for (const parallel::Budget& budget : {cancelled, parallel::Budget::Seconds(0)}) {
    const auto begun = std::chrono::steady_clock::now();
    const auto fewest = ChooseFewest(problem, 150, budget);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    ASSERT_TRUE(fewest.ok()) << fewest.status();
    EXPECT_LT(seconds, 5);
    if (budget.cancelled.stop_requested()) {
      EXPECT_TRUE(fewest->cover.stations.empty());
      EXPECT_FALSE(fewest->complete);
      EXPECT_TRUE(ChooseBest(problem, 5, budget)->stations.empty());
      continue;
    }
    EXPECT_TRUE(fewest->complete);
    EXPECT_TRUE(EachRegisters(problem, fewest->cover.stations));
    EXPECT_GE(fewest->cover.weight, 150 - 1e-6);
  }
}

TEST(ChooseFewest, BeginsWithWhatIsKnown) {
  const CoverProblem problem = MakeRooms(3, 12, 160, 1500);
  const double goal = 0.95 * ChooseBest(problem, 1000, Work(0))->weight;
  const auto greedy = ChooseFewest(problem, goal, Work(0));
  const auto searched = ChooseFewest(problem, goal, Work(200'000'000));
  ASSERT_LT(searched->cover.stations.size(), greedy->cover.stations.size());
  // Without any work left the answer is what is known, also with a part of it missing.
  const std::vector<uint32_t>& known = searched->cover.stations;
  const auto again = ChooseFewest(problem, goal, Work(0), known);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->cover.stations.size(), known.size());
  const auto completed =
      ChooseFewest(problem, goal, Work(0), std::span(known).first(known.size() - 1));
  EXPECT_LE(completed->cover.stations.size(), greedy->cover.stations.size());
  EXPECT_GE(WeightOf(problem, completed->cover.stations), goal - 1e-9);
  EXPECT_TRUE(EachRegisters(problem, completed->cover.stations));
  EXPECT_EQ(ChooseFewest(problem, goal, Work(0), std::vector<uint32_t>{999}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(ChooseFewest, AStoreyIsNoTrouble) {
  const CoverProblem problem = MakeRooms(5, 60, 3000, 20'000);
  const auto begun = std::chrono::steady_clock::now();
  const auto fewest = ChooseFewest(problem, 0.9 * 20'000 * 0.05, parallel::Budget::Seconds(2));
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  ASSERT_TRUE(fewest.ok()) << fewest.status();
  EXPECT_TRUE(fewest->complete);
  EXPECT_TRUE(EachRegisters(problem, fewest->cover.stations));
  EXPECT_GE(WeightOf(problem, fewest->cover.stations), 900 - 1e-6);
  EXPECT_GE(static_cast<double>(fewest->least),
            0.5 * static_cast<double>(fewest->cover.stations.size()));
  EXPECT_LT(seconds, 30);  // a busy machine under a sanitizer
}

TEST(ChooseFewest, SaysWhatContradictsItself) {
  const auto why = [](const CoverProblem& problem, double goal) {
    return ChooseFewest(problem, goal, parallel::Budget::Unlimited()).status();
  };
  const auto expect = [&](const CoverProblem& problem, double goal, const std::string& field) {
    const absl::Status status = why(problem, goal);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field;
    EXPECT_TRUE(absl::StartsWith(status.message(), field + ":")) << status;
  };
  const CoverProblem right = MakeRandomCover({});
  ASSERT_TRUE(why(right, 1).ok());
  expect(right, -1, "goal");
  expect(right, std::nan(""), "goal");
  CoverProblem wrong = right;
  wrong.weights[3] = 0;
  expect(wrong, 1, "weights");
  wrong = right;
  wrong.covers[2].push_back(0);
  expect(wrong, 1, "covers");
  wrong = right;
  wrong.covers[2].back() |= uint64_t{1} << 63;
  expect(wrong, 1, "covers");
  wrong = right;
  wrong.links.pop_back();
  expect(wrong, 1, "links");
  wrong = right;
  wrong.links[0] = {99};
  expect(wrong, 1, "links");
  wrong = right;
  wrong.links[0] = {0};
  expect(wrong, 1, "links");
  wrong = right;
  wrong.links[0] = {1, 2};
  wrong.links[1] = {0};
  wrong.links[2] = {};
  expect(wrong, 1, "links");
  wrong = right;
  wrong.anchored = {99};
  expect(wrong, 1, "anchored");
}

TEST(ChooseFewest, NothingIsAskedOrNothingIsThere) {
  const auto none = ChooseFewest({}, 0, parallel::Budget::Unlimited());
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_TRUE(none->complete);
  EXPECT_TRUE(none->cover.stations.empty());
  const auto empty = ChooseFewest({}, 1, parallel::Budget::Unlimited());
  ASSERT_TRUE(empty.ok()) << empty.status();
  EXPECT_FALSE(empty->complete);
  EXPECT_EQ(empty->least, 0u);
}

TEST(ChooseBest, IsTheBestOfAllChoices) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    const CoverProblem problem = MakeRandomCover(Small(seed));
    const ByTrying truth = TryAll(problem, 1e9);
    for (const size_t count : {1, 2, 3, 4, 6}) {
      const auto best = ChooseBest(problem, count, parallel::Budget::Unlimited());
      ASSERT_TRUE(best.ok()) << best.status();
      EXPECT_LE(best->stations.size(), count);
      EXPECT_TRUE(EachRegisters(problem, best->stations)) << "seed " << seed;
      EXPECT_NEAR(best->weight, WeightOf(problem, best->stations), 1e-9);
      EXPECT_NEAR(best->weight, truth.best[count], 1e-9) << "seed " << seed << ", " << count;
    }
  }
}

TEST(ChooseBest, TakesNoStationThatAddsNothing) {
  CoverProblem problem;
  problem.weights = {1, 1};
  problem.covers = {{3}, {1}, {2}};
  problem.links = {{1, 2}, {0}, {0}};
  const auto best = ChooseBest(problem, 3, parallel::Budget::Unlimited());
  ASSERT_TRUE(best.ok()) << best.status();
  EXPECT_EQ(best->stations, std::vector<uint32_t>{0});
  EXPECT_TRUE(ChooseBest(problem, 0, parallel::Budget::Unlimited())->stations.empty());
}

}  // namespace
}  // namespace vantage::cover
