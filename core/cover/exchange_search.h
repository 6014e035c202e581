// Local search: one station is exchanged for another until the choice covers more.
#ifndef VANTAGE_CORE_COVER_EXCHANGE_SEARCH_H_
#define VANTAGE_CORE_COVER_EXCHANGE_SEARCH_H_

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "core/cover/choice.h"
#include "core/cover/meter.h"

namespace vantage::cover {

// Which moves are taken and how long none is taken back, from one seed: the same on any machine.
class ExchangeSearch {
 public:
  ExchangeSearch(const Instance& instance, Meter& meter) : instance_(instance), meter_(meter) {}

  // As many stations as `from`, which hang together as those do, and cover `goal` (quanta) or, when
  // the meter is over or nothing better was found for long, the most that was found.
  std::vector<Index> Cover(const std::vector<Index>& from, int64_t goal);

 private:
  struct Move {
    size_t slot = 0;
    Index candidate = Choice::kVacant;
    int64_t change = 0;
  };
  Move BestMove(const Choice& choice, int64_t best, uint64_t now);
  void Exchange(Choice& choice, const Move& move, uint64_t now);
  void Shake(Choice& choice, uint64_t now);
  uint64_t Below(uint64_t end) { return random_() % end; }

  const Instance& instance_;
  Meter& meter_;
  std::mt19937_64 random_{1};
  std::vector<uint64_t> kept_until_;  // by candidate: steps until it may leave or come back
};

// Drops stations while the others hang together and cover `goal` (quanta), the one that loses least
// first.
void DropRedundant(Choice& choice, int64_t goal);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_EXCHANGE_SEARCH_H_
