#include "core/cover/choose_stations.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/cover/bonds.h"
#include "core/cover/choice.h"
#include "core/cover/exchange_search.h"
#include "core/cover/greedy.h"
#include "core/cover/instance.h"
#include "core/cover/lower_bound.h"
#include "core/cover/meter.h"

namespace vantage::cover {
namespace {

constexpr double kShareForBound = 0.2;  // of what is left of the budget

Cover MakeCover(const CoverProblem& problem, const Instance& instance,
                const std::vector<Index>& stations) {
  Cover cover;
  ElementSet covered = EmptySet(problem.weights.size());
  for (const Index i : InOrder(instance, stations)) {
    cover.stations.push_back(instance.number[i]);
    Unite(covered, problem.covers[instance.number[i]]);
  }
  ForEach(covered, [&](size_t e) { cover.weight += problem.weights[e]; });
  return cover;
}

// In quanta, less what rounding the weights may have taken away.
int64_t GoalOf(const CoverProblem& problem, double quantum, double goal) {
  constexpr double kMost = 0x1p60;  // more than all elements have
  return std::max<int64_t>(0, std::llround(std::min(goal / quantum, kMost)) -
                                  static_cast<int64_t>(problem.weights.size()));
}

// Those of `known` that are an instance's candidates, each once; none where not all are.
std::vector<Index> Among(const Instance& instance, std::span<const uint32_t> known) {
  std::vector<Index> among;
  for (const uint32_t station : known) {
    const auto at = std::lower_bound(instance.number.begin(), instance.number.end(), station);
    if (at == instance.number.end() || *at != station) return {};
    const auto index = static_cast<Index>(at - instance.number.begin());
    if (std::find(among.begin(), among.end(), index) == among.end()) among.push_back(index);
  }
  return among;
}

// The station that is dropped before others are exchanged to make up for it: of those that the
// others hang together without, the one that loses least.
std::vector<Index> WithoutOne(const Instance& instance, const std::vector<Index>& stations) {
  Choice choice(instance, stations);
  const Bonds bonds(choice);
  size_t least = choice.slots();
  for (size_t slot = 0; slot < choice.slots(); ++slot) {
    if (!bonds.MayDrop(slot)) continue;
    if (least == choice.slots() || choice.Loss(slot) < choice.Loss(least)) least = slot;
  }
  if (least < choice.slots()) choice.Drop(least);
  return choice.Stations();
}

std::vector<Index> WithoutRedundant(const Instance& instance, const std::vector<Index>& stations,
                                    int64_t goal) {
  Choice choice(instance, stations);
  DropRedundant(choice, goal);
  return choice.Stations();
}

}  // namespace

absl::StatusOr<FewestStations> ChooseFewest(const CoverProblem& problem, double goal,
                                            const parallel::Budget& budget,
                                            std::span<const uint32_t> known) {
  if (absl::Status checked = CheckProblem(problem); !checked.ok()) return checked;
  for (const uint32_t station : known) {
    if (station >= problem.candidates()) {
      return absl::InvalidArgumentError(
          absl::StrFormat("known: %d, of %d candidates", station, problem.candidates()));
    }
  }
  if (!std::isfinite(goal) || goal < 0) {
    return absl::InvalidArgumentError(absl::StrFormat("goal: %g m2; it is 0 or more", goal));
  }
  FewestStations fewest;
  if (goal == 0) return fewest;
  const std::vector<Instance> instances = MakeInstances(problem);
  if (instances.empty()) {
    fewest.complete = false;
    return fewest;
  }
  // Where groups don't hang together, the stations are of one of them; where none covers the goal,
  // of one that covers most.
  int64_t wanted = GoalOf(problem, instances.front().quantum, goal);
  int64_t most = 0;
  for (const Instance& instance : instances) most = std::max(most, instance.whole);
  fewest.complete = most >= wanted;
  wanted = std::min(wanted, most);

  Meter meter(budget);
  const Instance* best = nullptr;
  std::vector<Index> stations;
  size_t least = SIZE_MAX;
  bool covers = false;  // `stations` cover what is wanted
  for (const Instance& instance : instances) {
    if (instance.whole < wanted) continue;
    const Greedy greedy = ChooseGreedily(instance, wanted, instance.candidates(), meter);
    std::vector<Index> chosen = WithoutRedundant(instance, greedy.stations, wanted);
    if (const std::vector<Index> from = Among(instance, known); HangTogether(instance, from)) {
      const Greedy other = ChooseGreedily(instance, wanted, instance.candidates(), meter, from);
      std::vector<Index> completed = WithoutRedundant(instance, other.stations, wanted);
      if (completed.size() < chosen.size()) chosen = std::move(completed);
    }
    size_t bound = greedy.least;
    if (bound < chosen.size()) {
      Meter part = meter.Part(kShareForBound);
      bound = std::max(bound, LeastStations(instance, wanted, chosen.size(), part));
      meter.Resume(part);
    }
    least = std::min(least, bound);
    // Where the budget was cancelled on the way, what covers less than is wanted is better than
    // nothing.
    const bool these_cover = Choice(instance, chosen).covered() >= wanted;
    const bool fewer = !covers || chosen.size() < stations.size();
    if (best != nullptr && !(these_cover && fewer)) continue;
    best = &instance;
    covers = these_cover;
    stations = std::move(chosen);
  }
  fewest.complete = fewest.complete && covers;
  ExchangeSearch search(*best, meter);
  while (stations.size() > std::max<size_t>(least, 1) && !meter.Over()) {
    const std::vector<Index> fewer = search.Cover(WithoutOne(*best, stations), wanted);
    if (Choice(*best, fewer).covered() < wanted) break;
    stations = WithoutRedundant(*best, fewer, wanted);
  }
  fewest.cover = MakeCover(problem, *best, stations);
  fewest.least = least;
  return fewest;
}

absl::StatusOr<Cover> ChooseBest(const CoverProblem& problem, size_t count,
                                 const parallel::Budget& budget) {
  if (absl::Status checked = CheckProblem(problem); !checked.ok()) return checked;
  Cover best;
  Meter meter(budget);
  const std::vector<Instance> instances = MakeInstances(problem);
  for (size_t k = 0; k < instances.size(); ++k) {
    const Instance& instance = instances[k];
    Meter part = meter.Part(1 / static_cast<double>(instances.size() - k));
    const Greedy greedy = ChooseGreedily(instance, INT64_MAX, count, part);
    ExchangeSearch search(instance, part);
    Cover cover = MakeCover(problem, instance, search.Cover(greedy.stations, instance.whole));
    meter.Resume(part);
    if (best.stations.empty() || cover.weight > best.weight) best = std::move(cover);
  }
  return best;
}

}  // namespace vantage::cover
