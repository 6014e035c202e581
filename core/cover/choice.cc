#include "core/cover/choice.h"

#include <algorithm>
#include <utility>

namespace vantage::cover {

Choice::Choice(const Instance& instance)
    : instance_(instance),
      slot_of_(instance.candidates(), kNoSlot),
      counts_(instance.elements(), 0),
      sums_(instance.elements(), 0),
      gains_(instance.candidates(), 0),
      linked_(instance.candidates(), 0) {
  for (size_t e = 0; e < instance.elements(); ++e) {
    for (const Index i : instance.CoveredBy(e)) gains_[i] += instance.weights[e];
  }
  work_ = instance.covered_by.size();
}

Choice::Choice(const Instance& instance, std::span<const Index> stations) : Choice(instance) {
  for (const Index station : stations) Add(station);
}

std::vector<Index> Choice::Stations() const {
  std::vector<Index> stations;
  for (const Index station : stations_) {
    if (station != kVacant) stations.push_back(station);
  }
  return stations;
}

void Choice::Add(Index candidate) {
  const size_t vacant = static_cast<size_t>(std::find(stations_.begin(), stations_.end(), kVacant) -
                                            stations_.begin());
  if (vacant == stations_.size()) {
    stations_.push_back(kVacant);
    losses_.push_back(0);
    shared_.emplace_back(instance_.candidates(), 0);
  }
  const auto slot = static_cast<uint32_t>(vacant);
  stations_[slot] = candidate;
  slot_of_[candidate] = slot;
  ++size_;
  for (const Index i : instance_.links[candidate]) ++linked_[i];
  std::vector<int64_t>& shared = shared_[slot];
  ForEach(instance_.covers[candidate], [&](size_t e) {
    const int64_t weight = instance_.weights[e];
    const uint16_t before = counts_[e]++;
    const uint32_t others = std::exchange(sums_[e], sums_[e] + slot);
    if (before > 1) return;
    const auto row = instance_.CoveredBy(e);
    work_ += row.size();
    if (before == 0) {
      covered_ += weight;
      losses_[slot] += weight;
      for (const Index i : row) {
        gains_[i] -= weight;
        shared[i] += weight;
      }
    } else {
      losses_[others] -= weight;
      std::vector<int64_t>& of_other = shared_[others];
      for (const Index i : row) of_other[i] -= weight;
    }
  });
}

void Choice::Drop(size_t slot) {
  const Index candidate = stations_[slot];
  for (const Index i : instance_.links[candidate]) --linked_[i];
  ForEach(instance_.covers[candidate], [&](size_t e) {
    const int64_t weight = instance_.weights[e];
    const uint16_t left = --counts_[e];
    sums_[e] -= static_cast<uint32_t>(slot);
    if (left > 1) return;
    const auto row = instance_.CoveredBy(e);
    work_ += row.size();
    if (left == 0) {
      covered_ -= weight;
      for (const Index i : row) gains_[i] += weight;
    } else {
      const uint32_t other = sums_[e];
      losses_[other] += weight;
      std::vector<int64_t>& of_other = shared_[other];
      for (const Index i : row) of_other[i] += weight;
    }
  });
  losses_[slot] = 0;
  std::fill(shared_[slot].begin(), shared_[slot].end(), 0);
  stations_[slot] = kVacant;
  slot_of_[candidate] = kNoSlot;
  --size_;
}

uint64_t Choice::TakeWork() { return std::exchange(work_, 0); }

}  // namespace vantage::cover
