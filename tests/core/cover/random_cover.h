// Cover problems at random, and what is true of them by trying every choice.
#ifndef VANTAGE_TESTS_CORE_COVER_RANDOM_COVER_H_
#define VANTAGE_TESTS_CORE_COVER_RANDOM_COVER_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/cover/cover_problem.h"

namespace vantage::cover {

struct RandomCover {
  uint64_t seed = 1;
  size_t candidates = 12;
  size_t elements = 70;
  double covers = 0.25;   // chance that a candidate covers an element
  double links = 0.3;     // chance that two are linked
  double anchored = 0.2;  // chance that a candidate is; 0: none
};
CoverProblem MakeRandomCover(const RandomCover& of);

// Candidates and elements in rooms of a plan: who is near covers and is linked, as in a building.
CoverProblem MakeRooms(uint64_t seed, size_t rooms, size_t candidates, size_t elements);

// What a choice covers, m^2, from its definition.
double WeightOf(const CoverProblem& problem, const std::vector<uint32_t>& stations);
// Whether each station is anchored or linked with one before it; without anchors the first is free.
bool EachRegisters(const CoverProblem& problem, const std::vector<uint32_t>& stations);

struct ByTrying {
  std::optional<size_t> fewest;  // stations that hang together and cover the goal
  std::vector<double> best;      // by number of stations: the most that so many or fewer cover
  size_t fewest_apart = 0;       // those that need not hang together; 0: none cover it
};
// Of at most 20 candidates.
ByTrying TryAll(const CoverProblem& problem, double goal);

}  // namespace vantage::cover

#endif  // VANTAGE_TESTS_CORE_COVER_RANDOM_COVER_H_
