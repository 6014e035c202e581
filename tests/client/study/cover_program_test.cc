#include "client/study/cover_program.h"

#include <gtest/gtest.h>

#include <bit>

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
  problem.goal = 40;
  return problem;
}

// Members that hang together with the start, as bits.
uint32_t Together(const CoverProblem& problem, uint32_t chosen) {
  uint32_t met = uint32_t{1} << problem.start;
  for (uint32_t before = 0; before != met;) {
    before = met;
    for (size_t i = 0; i < problem.sets.size(); ++i) {
      if ((met >> i & 1) == 0) continue;
      for (const size_t j : problem.neighbours[i]) met |= chosen & (uint32_t{1} << j);
    }
  }
  return met;
}

// The fewest besides the start, by trying all; -1: none will do.
int FewestByTrying(const CoverProblem& problem) {
  int fewest = -1;
  for (uint32_t chosen = 0; chosen < uint32_t{1} << problem.sets.size(); ++chosen) {
    if ((chosen >> problem.start & 1) == 0) continue;
    const int count = std::popcount(chosen) - 1;
    if (fewest >= 0 && count >= fewest) continue;
    simulation::SampleSet covered(1, 0);
    for (size_t i = 0; i < problem.sets.size(); ++i) {
      if ((chosen >> i & 1) != 0) AddTo(covered, problem.sets[i]);
    }
    if (CountOf(covered) < problem.goal || Together(problem, chosen) != chosen) continue;
    fewest = count;
  }
  return fewest;
}

TEST(CoverProgram, FindsTheFewestThatHangTogether) {
  if (FindCoverSolver().empty()) {
    GTEST_SKIP() << "no solver here: install coinor-cbc or glpk-utils";
  }
  int solved = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const CoverProblem problem = RandomProblem(seed, 12, 0.25, seed % 2 == 0 ? 0.6 : 0.15);
    const int fewest = FewestByTrying(problem);
    const auto route = SolveCover(problem, 30);
    if (fewest < 0) {
      EXPECT_FALSE(route.ok()) << "seed " << seed;
      continue;
    }
    ASSERT_TRUE(route.ok()) << "seed " << seed << ": " << route.status();
    EXPECT_EQ(static_cast<int>(route->size()), fewest) << "seed " << seed;
    uint32_t chosen = uint32_t{1} << problem.start;
    for (const size_t i : *route) {
      // Each is joined with one before it.
      bool joined = false;
      for (const size_t j : problem.neighbours[i]) joined |= (chosen >> j & 1) != 0;
      EXPECT_TRUE(joined) << "seed " << seed;
      chosen |= uint32_t{1} << i;
    }
    ++solved;
  }
  EXPECT_GE(solved, 3);
}

TEST(CoverProgram, NothingToDoNeedsNoSolver) {
  CoverProblem problem = RandomProblem(1, 5, 0.5, 1);
  problem.goal = CountOf(problem.sets[0]);
  const auto route = SolveCover(problem, 1);
  ASSERT_TRUE(route.ok()) << route.status();
  EXPECT_TRUE(route->empty());
  problem.goal = 65;
  EXPECT_EQ(SolveCover(problem, 1).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace vantage::study
