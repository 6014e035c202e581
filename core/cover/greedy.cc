#include "core/cover/greedy.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "core/cover/choice.h"

namespace vantage::cover {
namespace {

// The fewest of `gains` whose sum is at least `missing`.
size_t FewestThatAdd(std::vector<int64_t> gains, int64_t missing) {
  std::sort(gains.begin(), gains.end(), std::greater<>());
  size_t count = 0;
  for (; missing > 0 && count < gains.size(); ++count) missing -= gains[count];
  return count;
}

// Candidates in the order of their distance, in links, from the choice, each with the one before it
// on the way that promises most.
class Ways {
 public:
  explicit Ways(const Choice& choice) {
    const Instance& instance = choice.instance();
    const size_t count = instance.candidates();
    steps_.assign(count, 0);
    promised_.assign(count, 0);
    before_.assign(count, Choice::kVacant);
    const bool free_first = !instance.rooted && choice.size() == 0;
    for (size_t i = 0; i < count; ++i) {
      const auto candidate = static_cast<Index>(i);
      if (choice.Has(candidate)) continue;
      if (!free_first && instance.anchored[i] == 0 && choice.Linked(candidate) == 0) continue;
      steps_[i] = 1;
      promised_[i] = choice.Gain(candidate);
      order_.push_back(candidate);
    }
    for (size_t head = 0; head < order_.size(); ++head) {
      const Index at = order_[head];
      for (const Index to : instance.links[at]) {
        if (choice.Has(to)) continue;
        if (steps_[to] == 0) {
          steps_[to] = steps_[at] + 1;
          order_.push_back(to);
        } else if (steps_[to] != steps_[at] + 1) {
          continue;
        }
        // Of the ways with the fewest links; all at one distance are met before the next.
        const int64_t promised = promised_[at] + choice.Gain(to);
        if (before_[to] == Choice::kVacant || promised > promised_[to]) {
          promised_[to] = promised;
          before_[to] = at;
        }
      }
    }
  }

  const std::vector<Index>& order() const { return order_; }
  size_t Steps(Index to) const { return steps_[to]; }
  int64_t Promised(Index to) const { return promised_[to]; }  // at most; overlaps count twice
  std::vector<Index> To(Index to) const {
    std::vector<Index> way;
    for (Index at = to; at != Choice::kVacant; at = before_[at]) way.push_back(at);
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  std::vector<Index> order_;
  std::vector<size_t> steps_;  // 0: not met
  std::vector<int64_t> promised_;
  std::vector<Index> before_;
};

// What `way` adds to what is covered, quanta.
int64_t Adds(const Instance& instance, const ElementSet& covered, const std::vector<Index>& way) {
  ElementSet together = covered;
  int64_t gain = 0;
  for (const Index i : way) {
    const ElementSet& set = instance.covers[i];
    ForEachBeyond(set, together, [&](size_t e) { gain += instance.weights[e]; });
    Unite(together, set);
  }
  return gain;
}

// The way that adds most for each station.
std::vector<Index> BestWay(const Choice& choice, const ElementSet& covered, size_t most,
                           Meter& meter) {
  const Ways ways(choice);
  std::vector<Index> order = ways.order();
  const auto promised = [&](Index i) {
    return static_cast<double>(ways.Promised(i)) / static_cast<double>(ways.Steps(i));
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return promised(a) > promised(b); });
  std::vector<Index> best;
  double best_rate = 0;
  for (const Index i : order) {
    if (promised(i) <= best_rate) break;
    if (ways.Steps(i) > most) continue;
    std::vector<Index> way = ways.To(i);
    const int64_t adds = way.size() == 1 ? choice.Gain(i) : Adds(choice.instance(), covered, way);
    meter.Add(way.size() == 1 ? 1 : way.size() * covered.size());
    const double rate = static_cast<double>(adds) / static_cast<double>(way.size());
    if (rate <= best_rate) continue;
    best_rate = rate;
    best = std::move(way);
  }
  return best;
}

}  // namespace

Greedy ChooseGreedily(const Instance& instance, int64_t goal, size_t most, Meter& meter,
                      const std::vector<Index>& from) {
  Greedy greedy;
  Choice choice(instance);
  ElementSet covered = EmptySet(instance.elements());
  const auto take = [&](Index i) {
    choice.Add(i);
    greedy.stations.push_back(i);
    Unite(covered, instance.covers[i]);
  };
  for (const Index i : from) take(i);
  while (choice.covered() < goal && choice.size() < most && !meter.Cancelled()) {
    greedy.least = std::max(greedy.least, FewestThatAdd(choice.Gains(), goal - choice.covered()));
    const std::vector<Index> way = BestWay(choice, covered, most - choice.size(), meter);
    if (way.empty()) break;
    for (const Index i : way) take(i);
  }
  greedy.covered = choice.covered();
  meter.Add(choice.TakeWork());
  return greedy;
}

}  // namespace vantage::cover
