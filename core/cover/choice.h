// A set of chosen stations, and what adding, dropping or exchanging any of them would change.
#ifndef VANTAGE_CORE_COVER_CHOICE_H_
#define VANTAGE_CORE_COVER_CHOICE_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cover/instance.h"

namespace vantage::cover {

// All three are kept up to date with each change, element by element and only where the number of
// stations that cover it passes between none, one and two (Resende and Werneck, 'A fast swap-based
// local search procedure for location problems', 2007). Keeps the reference.
class Choice {
 public:
  explicit Choice(const Instance& instance);
  Choice(const Instance& instance, std::span<const Index> stations);

  static constexpr Index kVacant = UINT16_MAX;

  // Stations stand in slots, which keep their numbers; some are vacant.
  size_t slots() const { return stations_.size(); }
  Index At(size_t slot) const { return stations_[slot]; }
  size_t size() const { return size_; }
  bool Has(Index candidate) const { return slot_of_[candidate] != kNoSlot; }
  size_t SlotOf(Index candidate) const { return slot_of_[candidate]; }
  std::vector<Index> Stations() const;

  int64_t covered() const { return covered_; }  // quanta
  // What a candidate would add, what dropping a station would lose, and what exchanging one for a
  // candidate would change, quanta.
  int64_t Gain(Index candidate) const { return gains_[candidate]; }
  int64_t Loss(size_t slot) const { return losses_[slot]; }
  int64_t Change(size_t slot, Index candidate) const {
    return gains_[candidate] - losses_[slot] + shared_[slot][candidate];
  }
  const std::vector<int64_t>& Gains() const { return gains_; }
  // Of what dropping the station would lose: what each candidate covers, too.
  const std::vector<int64_t>& Shared(size_t slot) const { return shared_[slot]; }
  // How many stations a candidate is linked with.
  uint32_t Linked(Index candidate) const { return linked_[candidate]; }

  void Add(Index candidate);
  void Drop(size_t slot);

  uint64_t TakeWork();  // since it was last asked

  const Instance& instance() const { return instance_; }

 private:
  static constexpr uint32_t kNoSlot = UINT32_MAX;

  const Instance& instance_;
  std::vector<Index> stations_;  // by slot
  std::vector<uint32_t> slot_of_;
  size_t size_ = 0;
  std::vector<uint16_t> counts_;  // by element: stations that cover it
  std::vector<uint32_t> sums_;    // by element: of their slots, so of one station its slot
  std::vector<int64_t> gains_;    // by candidate
  std::vector<int64_t> losses_;   // by slot
  std::vector<std::vector<int64_t>> shared_;
  std::vector<uint32_t> linked_;
  int64_t covered_ = 0;
  uint64_t work_ = 0;
};

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_CHOICE_H_
