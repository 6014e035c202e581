// Compares the shared visible sets of neighbouring views with the cells that each of them gains.
#include "core/planning/evaluation/visibility_cache.h"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/parallel/thread_pool.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/scanned_office.h"

namespace vantage::planning {
namespace {

// An office storey of many rooms, or one room.
class VisibilityCacheTest : public ::testing::TestWithParam<bool> {
 protected:
  static test_support::PlanningProblem MakeProblem(bool pose_sensitivity) {
    PlanningConfig config;
    config.viewcell_size = GetParam() ? 0.3 : 0.2;
    config.pose_sensitivity = pose_sensitivity;
    return {GetParam() ? test_support::ScannedOffice()
                       : std::make_shared<model::PlanningView>(
                             test_support::BuildView(test_support::FurnishedRoom(2))),
            config};
  }
  static size_t Packets(const std::vector<PacketRange>& ranges) {
    return std::accumulate(
        ranges.begin(), ranges.end(), size_t{0},
        [](size_t sum, const PacketRange& range) { return sum + (range.end - range.begin); });
  }

  std::mt19937_64 random_{5};
};

TEST_P(VisibilityCacheTest, TheCacheIsFilledWhenThatIsWorthIt) {
  for (const bool pose_sensitivity : {false, true}) {
    const test_support::PlanningProblem problem = MakeProblem(pose_sensitivity);
    const OrderedCells& cells = problem.scoring->cells();
    const BruteForceScorer& scorer = problem.scoring->scorer();
    parallel::Serial serial;
    parallel::ThreadPool pool(3);
    VisibilityCache one(scorer, problem.feasible, cells, problem.grid);
    VisibilityCache other(scorer, problem.feasible, cells, problem.grid);
    std::vector<uint32_t> which(40);
    for (uint32_t& view : which) view = static_cast<uint32_t>(random_() % problem.views.size());
    // Scoring each on few cells is cheaper than finding the set.
    one.Prepare(which, 1, parallel::Budget::Unlimited(), serial);
    for (const uint32_t i : which) EXPECT_EQ(one.PotentiallyVisibleFrom(i), nullptr);
    one.Prepare(which, cells.size(), parallel::Budget::Unlimited(), serial);
    other.Prepare(which, cells.size(), parallel::Budget::Unlimited(), pool);
    uint64_t all_rays = 0;
    uint64_t seen_rays = 0;
    for (const uint32_t i : which) {
      ASSERT_NE(one.PotentiallyVisibleFrom(i), nullptr);
      ASSERT_NE(other.PotentiallyVisibleFrom(i), nullptr);
      EXPECT_EQ(Packets(*one.PotentiallyVisibleFrom(i)), Packets(*other.PotentiallyVisibleFrom(i)));
      const ViewScore all = scorer.Score(problem.views[i], cells, parallel::Budget::Unlimited());
      const ViewScore seen = scorer.ScorePackets(
          problem.views[i], cells, *one.PotentiallyVisibleFrom(i), parallel::Budget::Unlimited());
      EXPECT_NEAR(seen.score, all.score, 1e-9 * all.score);
      EXPECT_LE(seen.rays, all.rays);
      all_rays += all.rays;
      seen_rays += seen.rays;
    }
    if (GetParam()) {
      EXPECT_LT(seen_rays, all_rays);  // rooms hide each other
    }
  }
}

TEST_P(VisibilityCacheTest, WhoHasNoTimeToLookScoresAll) {
  const test_support::PlanningProblem problem = MakeProblem(false);
  const OrderedCells& cells = problem.scoring->cells();
  VisibilityCache cache(problem.scoring->scorer(), problem.feasible, cells, problem.grid);
  parallel::Serial serial;
  const uint32_t view = 0;
  cache.Prepare({&view, 1}, cells.size(), parallel::Budget::Seconds(-1), serial);
  EXPECT_EQ(cache.PotentiallyVisibleFrom(view), nullptr);
}

INSTANTIATE_TEST_SUITE_P(Scenes, VisibilityCacheTest, ::testing::Bool(),
                         [](const auto& param) { return param.param ? "Office" : "Room"; });

}  // namespace
}  // namespace vantage::planning
