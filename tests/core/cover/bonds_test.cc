#include "core/cover/bonds.h"

#include <gtest/gtest.h>

#include "core/simulation/random_sequence.h"
#include "tests/core/cover/random_cover.h"

namespace vantage::cover {
namespace {

std::vector<uint32_t> Numbers(const Instance& instance, const std::vector<Index>& stations) {
  std::vector<uint32_t> numbers;
  for (const Index i : InOrder(instance, stations)) numbers.push_back(instance.number[i]);
  return numbers;
}

// Whether they hang together, by whether there is an order in which each registers.
bool Together(const CoverProblem& problem, const Instance& instance,
              const std::vector<Index>& stations) {
  const std::vector<uint32_t> order = Numbers(instance, stations);
  return order.size() == stations.size() && EachRegisters(problem, order);
}

TEST(Bonds, KnowWhatHoldsAChoiceTogether) {
  int needed = 0;
  int refused = 0;
  int replaced = 0;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    RandomCover of{seed};
    of.links = 0.2;
    of.anchored = seed % 2 == 0 ? 0.15 : 0;
    const CoverProblem problem = MakeRandomCover(of);
    for (const Instance& instance : MakeInstances(problem)) {
      // Grown one by one, so that it hangs together.
      simulation::RandomSequence random(seed);
      Choice choice(instance);
      for (int tries = 0; tries < 60 && choice.size() < 6; ++tries) {
        const auto i = static_cast<Index>(random.Below(instance.candidates()));
        const bool joins = choice.Linked(i) > 0 || instance.anchored[i] != 0 ||
                           (!instance.rooted && choice.size() == 0);
        if (!choice.Has(i) && joins) choice.Add(i);
      }
      const std::vector<Index> stations = choice.Stations();
      ASSERT_TRUE(HangTogether(instance, stations));
      ASSERT_TRUE(Together(problem, instance, stations));
      const Bonds bonds(choice);
      for (const Index out : stations) {
        const size_t slot = choice.SlotOf(out);
        std::vector<Index> left = stations;
        std::erase(left, out);
        const bool together = Together(problem, instance, left);
        EXPECT_EQ(bonds.MayDrop(slot), together) << "seed " << seed;
        EXPECT_EQ(HangTogether(instance, left), together) << "seed " << seed;
        needed += together ? 0 : 1;
        for (Index i = 0; i < instance.candidates(); ++i) {
          if (choice.Has(i)) continue;
          left.push_back(i);
          const bool may = Together(problem, instance, left);
          EXPECT_EQ(bonds.MayReplace(slot, i), may)
              << "seed " << seed << ": " << i << " for " << out;
          (may ? replaced : refused) += 1;
          left.pop_back();
        }
      }
    }
  }
  EXPECT_GT(needed, 20);
  EXPECT_GT(refused, 100);
  EXPECT_GT(replaced, 100);
}

}  // namespace
}  // namespace vantage::cover
