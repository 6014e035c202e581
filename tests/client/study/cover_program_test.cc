#include "client/study/cover_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "client/study/study_scene.h"
#include "core/cover/choose_stations.h"
#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

CoverProblem RandomProblem(uint64_t seed, size_t candidates, double share, double joined) {
  constexpr size_t kElements = 60;
  simulation::RandomSequence random(seed);
  CoverProblem problem;
  for (size_t i = 0; i < candidates; ++i) {
    simulation::SampleSet set(1, 0);
    for (size_t e = 0; e < kElements; ++e) {
      if (random.Chance(share)) set[0] |= uint64_t{1} << e;
    }
    problem.sets.push_back(set);
  }
  problem.neighbours.resize(candidates);
  for (size_t i = 0; i < candidates; ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (!random.Chance(joined)) continue;
      problem.neighbours[i].push_back(j);
      problem.neighbours[j].push_back(i);
    }
  }
  problem.start = 0;
  problem.goal = 40;
  return problem;
}

// Members of `chosen` that hang together with `from`, as bits.
uint32_t Together(const CoverProblem& problem, uint32_t chosen, uint32_t from) {
  uint32_t met = from;
  for (uint32_t before = 0; before != met;) {
    before = met;
    for (size_t i = 0; i < problem.sets.size(); ++i) {
      if ((met >> i & 1) == 0) continue;
      for (const size_t j : problem.neighbours[i]) met |= chosen & (uint32_t{1} << j);
    }
  }
  return met;
}

// The fewest, by trying all; -1: none will do.
int FewestByTrying(const CoverProblem& problem) {
  int fewest = -1;
  for (uint32_t chosen = 1; chosen < uint32_t{1} << problem.sets.size(); ++chosen) {
    if (problem.start && (chosen >> *problem.start & 1) == 0) continue;
    const int count = std::popcount(chosen);
    if (fewest >= 0 && count >= fewest) continue;
    simulation::SampleSet covered(1, 0);
    for (size_t i = 0; i < problem.sets.size(); ++i) {
      if ((chosen >> i & 1) != 0) AddTo(covered, problem.sets[i]);
    }
    if (CountOf(covered) < problem.goal) continue;
    if (Together(problem, chosen, chosen & (~chosen + 1)) == chosen) fewest = count;
  }
  return fewest;
}

// The same problem for core/cover.
cover::CoverProblem ForSearch(const CoverProblem& problem) {
  cover::CoverProblem made;
  made.covers = problem.sets;
  made.weights.assign(60, 1.0);
  for (const std::vector<size_t>& links : problem.neighbours) {
    made.links.emplace_back(links.begin(), links.end());
    std::sort(made.links.back().begin(), made.links.back().end());
  }
  if (problem.start) {
    made.anchored = made.links[*problem.start];
    const simulation::SampleSet seen = problem.sets[*problem.start];
    for (simulation::SampleSet& set : made.covers) set[0] &= ~seen[0];
  }
  return made;
}

void ExpectJoined(const CoverProblem& problem, const std::vector<size_t>& route) {
  uint32_t chosen = uint32_t{1} << route.front();
  EXPECT_EQ(route.front(), problem.start.value_or(route.front()));
  for (size_t k = 1; k < route.size(); ++k) {
    bool joined = false;
    for (const size_t j : problem.neighbours[route[k]]) joined |= (chosen >> j & 1) != 0;
    EXPECT_TRUE(joined) << route[k];
    chosen |= uint32_t{1} << route[k];
  }
}

TEST(CoverProgram, FindsTheFewestThatHangTogether) {
  if (FindCoverSolver().empty()) {
    GTEST_SKIP() << "no solver here: install coinor-cbc or glpk-utils";
  }
  int solved = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    CoverProblem problem = RandomProblem(seed, 12, 0.25, seed % 2 == 0 ? 0.6 : 0.15);
    if (seed > 4) problem.start.reset();
    const int fewest = FewestByTrying(problem);
    const auto answer = SolveCover(problem, 30);
    if (fewest < 0) {
      EXPECT_FALSE(answer.ok()) << "seed " << seed;
      continue;
    }
    ASSERT_TRUE(answer.ok()) << "seed " << seed << ": " << answer.status();
    EXPECT_TRUE(answer->proven) << "seed " << seed;
    EXPECT_EQ(static_cast<int>(answer->route.size()), fewest) << "seed " << seed;
    ExpectJoined(problem, answer->route);
    // The same from a choice that is known.
    const auto again = SolveCover(problem, 30, answer->route);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->route.size(), answer->route.size());
    ++solved;
  }
  EXPECT_GE(solved, 4);
}

// Local search against the integer optimum, where trying all would take too long.
TEST(CoverProgram, LocalSearchFindsTheIntegerOptimum) {
  if (FindCoverSolver().empty()) {
    GTEST_SKIP() << "no solver here: install coinor-cbc or glpk-utils";
  }
  for (uint64_t seed = 11; seed <= 14; ++seed) {
    CoverProblem problem = RandomProblem(seed, 30, 0.12, 0.2);
    if (seed % 2 == 0) problem.start.reset();
    problem.goal = 50;
    const auto answer = SolveCover(problem, 60);
    const size_t of_start = problem.start ? CountOf(problem.sets[*problem.start]) : 0;
    const auto found =
        cover::ChooseFewest(ForSearch(problem), static_cast<double>(problem.goal - of_start),
                            parallel::Budget::Seconds(5));
    ASSERT_TRUE(found.ok()) << found.status();
    if (!answer.ok()) {
      EXPECT_FALSE(found->complete) << "seed " << seed << ": " << answer.status();
      continue;
    }
    ASSERT_TRUE(answer->proven) << "seed " << seed;
    const size_t stations = found->cover.stations.size() + (problem.start ? 1 : 0);
    EXPECT_EQ(stations, answer->route.size()) << "seed " << seed;
    EXPECT_LE(found->least + (problem.start ? 1 : 0), answer->route.size()) << "seed " << seed;
  }
}

TEST(CoverProgram, NothingToDoNeedsNoSolver) {
  CoverProblem problem = RandomProblem(1, 5, 0.5, 1);
  problem.goal = CountOf(problem.sets[0]);
  const auto answer = SolveCover(problem, 1);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->route, std::vector<size_t>{0});
  EXPECT_TRUE(answer->proven);
  problem.goal = 65;
  EXPECT_EQ(SolveCover(problem, 1).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace vantage::study
