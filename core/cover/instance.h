// A cover problem made ready for search: only what can be chosen, elements that the same candidates
// cover counted together, weights as whole numbers, so that sums neither drift nor depend on order.
#ifndef VANTAGE_CORE_COVER_INSTANCE_H_
#define VANTAGE_CORE_COVER_INSTANCE_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/cover/cover_problem.h"

namespace vantage::cover {

// Candidates are named by this.
using Index = uint16_t;
constexpr size_t kMostCandidates = 65'535;

// INVALID_ARGUMENT: the problem contradicts itself; the message names the field.
absl::Status CheckProblem(const CoverProblem& problem);

struct Instance {
  std::vector<uint32_t> number;  // of each candidate, in the problem
  std::vector<int64_t> weights;  // by element, quanta
  double quantum = 0;            // m^2
  std::vector<ElementSet> covers;
  std::vector<std::vector<Index>> links;
  std::vector<ElementSet> linked;  // the same as bits
  std::vector<uint8_t> anchored;   // by candidate
  bool rooted = false;             // some candidates are anchored; else the first station is free
  // The candidates that cover element e are covered_by[first[e]] to covered_by[first[e + 1]].
  std::vector<size_t> first;
  std::vector<Index> covered_by;
  int64_t whole = 0;  // all weights, quanta

  size_t candidates() const { return number.size(); }
  size_t elements() const { return weights.size(); }
  bool Linked(Index a, Index b) const { return (linked[a][b / 64] >> (b % 64) & 1) != 0; }
  std::span<const Index> CoveredBy(size_t element) const {
    return {covered_by.data() + first[element], first[element + 1] - first[element]};
  }
};

// The instances of a problem that is right: one of what hangs together with the anchors, or, where
// there are none, one for each group of candidates that hang together. Of candidates alone that
// cover nothing there is none. `goal` (m^2) is left out of account.
std::vector<Instance> MakeInstances(const CoverProblem& problem);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_INSTANCE_H_
