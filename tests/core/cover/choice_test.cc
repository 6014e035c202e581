#include "core/cover/choice.h"

#include <gtest/gtest.h>

#include "core/simulation/random_sequence.h"
#include "tests/core/cover/random_cover.h"

namespace vantage::cover {
namespace {

// What stations cover, quanta, from its definition.
int64_t Covered(const Instance& instance, const std::vector<Index>& stations) {
  int64_t sum = 0;
  for (size_t e = 0; e < instance.elements(); ++e) {
    bool covered = false;
    for (const Index i : stations) covered |= (instance.covers[i][e / 64] >> (e % 64) & 1) != 0;
    if (covered) sum += instance.weights[e];
  }
  return sum;
}

TEST(Choice, KnowsWhatEveryChangeWouldDo) {
  RandomCover of{7};
  of.links = 1;
  of.anchored = 0;
  const std::vector<Instance> instances = MakeInstances(MakeRandomCover(of));
  ASSERT_EQ(instances.size(), 1u);
  const Instance& instance = instances.front();
  simulation::RandomSequence random(3);
  Choice choice(instance);
  for (int step = 0; step < 60; ++step) {
    const auto candidate = static_cast<Index>(random.Below(instance.candidates()));
    if (!choice.Has(candidate)) {
      choice.Add(candidate);
    } else {
      choice.Drop(choice.SlotOf(candidate));
    }
    const std::vector<Index> stations = choice.Stations();
    ASSERT_EQ(stations.size(), choice.size());
    const int64_t covered = Covered(instance, stations);
    ASSERT_EQ(choice.covered(), covered) << "step " << step;
    for (Index i = 0; i < instance.candidates(); ++i) {
      if (choice.Has(i)) {
        std::vector<Index> without = stations;
        std::erase(without, i);
        ASSERT_EQ(choice.Loss(choice.SlotOf(i)), covered - Covered(instance, without));
        continue;
      }
      std::vector<Index> with = stations;
      with.push_back(i);
      ASSERT_EQ(choice.Gain(i), Covered(instance, with) - covered);
      for (const Index out : stations) {
        std::vector<Index> exchanged = with;
        std::erase(exchanged, out);
        ASSERT_EQ(choice.Change(choice.SlotOf(out), i), Covered(instance, exchanged) - covered)
            << "step " << step << ": " << i << " for " << out;
      }
    }
  }
}

}  // namespace
}  // namespace vantage::cover
