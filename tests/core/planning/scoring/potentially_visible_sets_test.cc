// Compares the cells hidden from a box of views with the cells that each of them gains.
#include "core/planning/scoring/potentially_visible_sets.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "core/parallel/budget.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/scanned_office.h"

namespace vantage::planning {
namespace {

// An office storey of many rooms, or one room.
class PotentiallyVisibleSetsTest : public ::testing::TestWithParam<bool> {
 protected:
  static test_support::PlanningProblem MakeProblem() {
    PlanningConfig config;
    config.viewcell_size = GetParam() ? 0.3 : 0.2;
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

TEST_P(PotentiallyVisibleSetsTest, NothingIsGainedOutOfSight) {
  const test_support::PlanningProblem problem = MakeProblem();
  const OrderedCells& cells = problem.scoring->cells();
  const visibility::OcclusionScene& scene = problem.scoring->scene();
  const PotentiallyVisibleSets potentially_visible(cells, problem.grid);
  std::vector<float> scores(cells.size());
  size_t packets = 0;
  size_t all = 0;
  for (int k = 0; k < 60; ++k) {
    const Eigen::Vector3d& at = problem.views[random_() % problem.views.size()];
    const double side = std::array{0.0, 0.3, 0.7, 1.5}[static_cast<size_t>(k % 4)];  // m
    const Eigen::AlignedBox3d box(at.array() - side / 2, at.array() + side / 2);
    const std::vector<PacketRange> ranges = potentially_visible.From(
        {scene.ToScene(box.min() / problem.model->voxel_size()).cast<double>(),
         scene.ToScene(box.max() / problem.model->voxel_size()).cast<double>()});
    packets += Packets(ranges);
    all += cells.packets();
    std::vector<bool> listed(cells.packets(), false);
    for (const PacketRange& range : ranges) {
      ASSERT_LT(range.begin, range.end);
      ASSERT_LE(range.end, cells.packets());
      for (uint32_t packet = range.begin; packet < range.end; ++packet) {
        ASSERT_FALSE(listed[packet]);
        listed[packet] = true;
      }
    }
    for (const Eigen::Vector3d& view : problem.views) {
      if (!box.contains(view) || (side > 1 && random_() % 8 != 0)) continue;
      problem.scoring->scorer().ScoreCells(view, cells, parallel::Budget::Unlimited(), scores);
      for (size_t i = 0; i < scores.size(); ++i) {
        ASSERT_TRUE(scores[i] == 0 || listed[i / CellArrays::kPacket]) << k << " cell " << i;
      }
    }
  }
  // Rooms hide each other.
  if (GetParam()) {
    EXPECT_LT(packets, all * 3 / 4);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, PotentiallyVisibleSetsTest, ::testing::Bool(),
                         [](const auto& param) { return param.param ? "Office" : "Room"; });

}  // namespace
}  // namespace vantage::planning
