// What keeps chosen stations together: which of them could go without the others falling apart, and
// which candidate could take whose place.
#ifndef VANTAGE_CORE_COVER_BONDS_H_
#define VANTAGE_CORE_COVER_BONDS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/cover/choice.h"
#include "core/cover/cover_problem.h"

namespace vantage::cover {

// Of a choice that hangs together, until it changes. Keeps the reference.
class Bonds {
 public:
  explicit Bonds(const Choice& choice);

  // Whether the others still hang together without the station.
  bool MayDrop(size_t slot) const { return parts_[slot].empty(); }
  // Whether a candidate that is not chosen could take the station's place.
  bool MayReplace(size_t slot, Index candidate) const;

 private:
  using Part = std::vector<Index>;  // stations

  // What the others fall into without the station, the part with the anchors first.
  std::vector<Part> PartsWithout(size_t slot) const;

  const Choice& choice_;
  // By slot. Empty: they stay in one piece, as nearly always.
  std::vector<std::vector<Part>> parts_;
};

// Whether stations hang together, as a CoverProblem has it.
bool HangTogether(const Instance& instance, const std::vector<Index>& stations);
bool HangTogether(const CoverProblem& problem, const std::vector<uint32_t>& stations);

// The same stations so that each is anchored or linked with one before it, of those the one next
// that adds most. They hang together.
std::vector<Index> InOrder(const Instance& instance, const std::vector<Index>& stations);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_BONDS_H_
