#include "core/cover/exchange_search.h"

#include <algorithm>
#include <limits>

#include "core/cover/bonds.h"

namespace vantage::cover {
namespace {

// Steps without anything better after which the search ends, for each pair of a station and a
// candidate, and after which several stations are exchanged at random.
constexpr uint64_t kPatienceByPair = 100;
constexpr uint64_t kShakeAfter = 400;
constexpr size_t kMostShaken = 4;

}  // namespace

ExchangeSearch::Move ExchangeSearch::BestMove(const Choice& choice, int64_t best, uint64_t now) {
  const Bonds bonds(choice);
  Move move;
  move.change = std::numeric_limits<int64_t>::min();
  uint64_t equals = 0;
  const int64_t to_be_best = best - choice.covered();
  const auto count = static_cast<Index>(instance_.candidates());
  const std::vector<int64_t>& gains = choice.Gains();
  for (size_t slot = 0; slot < choice.slots(); ++slot) {
    if (choice.At(slot) == Choice::kVacant) continue;
    const bool kept = kept_until_[choice.At(slot)] > now;
    const std::vector<int64_t>& shared = choice.Shared(slot);
    const int64_t loss = choice.Loss(slot);
    for (Index i = 0; i < count; ++i) {
      const int64_t change = gains[i] - loss + shared[i];
      if (change < move.change || choice.Has(i)) continue;
      if ((kept || kept_until_[i] > now) && change <= to_be_best) continue;
      if (change == move.change && Below(++equals) != 0) continue;
      if (!bonds.MayReplace(slot, i)) continue;
      if (change > move.change) equals = 1;
      move = {slot, i, change};
    }
  }
  meter_.Add(choice.size() * (instance_.candidates() + 8 * choice.size()));
  return move;
}

void ExchangeSearch::Exchange(Choice& choice, const Move& move, uint64_t now) {
  const Index leaves = choice.At(move.slot);
  choice.Drop(move.slot);
  choice.Add(move.candidate);
  kept_until_[leaves] = now + 5 + Below(10 + choice.size() / 2);
  kept_until_[move.candidate] = now + 2 + Below(2 + choice.size() / 3);
  meter_.Add(choice.TakeWork());
}

void ExchangeSearch::Shake(Choice& choice, uint64_t now) {
  const size_t moves = 2 + Below(kMostShaken - 1);
  for (size_t k = 0; k < moves; ++k) {
    const Bonds bonds(choice);
    std::vector<size_t> slots;
    for (size_t slot = 0; slot < choice.slots(); ++slot) {
      if (choice.At(slot) != Choice::kVacant) slots.push_back(slot);
    }
    const size_t slot = slots[Below(slots.size())];
    std::vector<Index> able;
    for (size_t i = 0; i < instance_.candidates(); ++i) {
      const auto candidate = static_cast<Index>(i);
      if (!choice.Has(candidate) && bonds.MayReplace(slot, candidate)) able.push_back(candidate);
    }
    if (!able.empty()) Exchange(choice, {slot, able[Below(able.size())], 0}, now);
  }
}

std::vector<Index> ExchangeSearch::Cover(const std::vector<Index>& from, int64_t goal) {
  Choice choice(instance_, from);
  std::vector<Index> best = from;
  int64_t most = choice.covered();
  kept_until_.assign(instance_.candidates(), 0);
  uint64_t last_better = 0;
  uint64_t last_shake = 0;
  const uint64_t patience = kPatienceByPair * choice.size() * instance_.candidates();
  for (uint64_t now = 1; most < goal && now - last_better < patience && !meter_.Over(); ++now) {
    const Move move = BestMove(choice, most, now);
    if (move.candidate != Choice::kVacant) Exchange(choice, move, now);
    if (choice.covered() > most) {
      most = choice.covered();
      best = choice.Stations();
      last_better = last_shake = now;
    } else if (now - last_shake > kShakeAfter) {
      Shake(choice, now);
      last_shake = now;
    }
  }
  return best;
}

void DropRedundant(Choice& choice, int64_t goal) {
  while (true) {
    const Bonds bonds(choice);
    size_t least = choice.slots();
    for (size_t slot = 0; slot < choice.slots(); ++slot) {
      if (choice.At(slot) == Choice::kVacant || !bonds.MayDrop(slot)) continue;
      if (choice.covered() - choice.Loss(slot) < goal) continue;
      if (least == choice.slots() || choice.Loss(slot) < choice.Loss(least)) least = slot;
    }
    if (least == choice.slots()) return;
    choice.Drop(least);
  }
}

}  // namespace vantage::cover
