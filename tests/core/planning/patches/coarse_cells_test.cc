// Where there are too many deficient voxels, a cell stands for those of a cube (algorithm.md
// section 7B).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/planning/patches/collect_deficient.h"
#include "core/planning/patches/patches.h"
#include "core/planning/problem/planning_problem.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

// Cube, kind, and the axis direction that is nearest to the normal.
using Group = std::tuple<int, int, int, model::SurfaceKind, int, bool>;

Group GroupOf(const DeficientCell& cell, int cube) {
  int axis = 0;
  cell.normal.cwiseAbs().maxCoeff(&axis);
  const auto down = [cube](int v) { return static_cast<int>(std::floor(1.0 * v / cube)); };
  return {down(cell.voxel.x()), down(cell.voxel.y()), down(cell.voxel.z()), cell.kind, axis,
          cell.normal[axis] < 0};
}

class CoarseCellsTest : public ::testing::TestWithParam<int> {
 protected:
  CoarseCellsTest()
      : model_(test_support::BuildView(test_support::FurnishedRoom(3))), fine_(Ranked(config_)) {}

  // Of a configuration with as many cells as make cubes of `cube` voxels.
  PlanningConfig Coarse(int cube) const {
    PlanningConfig config = config_;
    const int shift = cube == 2 ? 1 : cube == 4 ? 2 : 3;
    config.max_cells = static_cast<uint64_t>(std::ceil(CellsOfCubes(fine_.cells.size(), shift)));
    return config;
  }
  PatchSet Ranked(const PlanningConfig& config) const {
    return RankPatches(config, ExtractPatches(model_, config).value()).value();
  }

  model::PlanningView model_;
  PlanningConfig config_;
  PatchSet fine_;
};

TEST_P(CoarseCellsTest, EachStandsForTheVoxelsOfItsCubeThatAreLikeIt) {
  const int cube = GetParam();
  struct Sum {
    double area = 0;
    double samples = 0;
  };
  std::map<Group, Sum> expected;
  std::set<std::tuple<int, int, int>> voxels;
  for (const DeficientCell& cell : fine_.cells) {
    Sum& sum = expected[GroupOf(cell, cube)];
    sum.area += cell.area;
    sum.samples += cell.area * cell.density;
    voxels.emplace(cell.voxel.x(), cell.voxel.y(), cell.voxel.z());
  }
  const PatchSet coarse = Ranked(Coarse(cube));
  EXPECT_EQ(coarse.cube, cube);
  ASSERT_EQ(coarse.cells.size(), expected.size());
  EXPECT_NEAR(coarse.area, fine_.area, 1e-4 * fine_.area);
  for (const DeficientCell& cell : coarse.cells) {
    EXPECT_TRUE(voxels.contains({cell.voxel.x(), cell.voxel.y(), cell.voxel.z()}));
    const auto it = expected.find(GroupOf(cell, cube));
    ASSERT_NE(it, expected.end());
    EXPECT_NEAR(cell.area, it->second.area, 1e-4 * it->second.area);
    EXPECT_NEAR(cell.density, it->second.samples / it->second.area, 1e-3 * cell.density + 1e-6);
    expected.erase(it);
  }
}

TEST_P(CoarseCellsTest, PatchesHangTogetherByCubesAndAreOfOneKind) {
  const int cube = GetParam();
  const PatchSet coarse = Ranked(Coarse(cube));
  uint32_t next = 0;
  for (const Patch& patch : coarse.patches) {
    std::set<std::tuple<int, int, int>> left;
    std::vector<std::tuple<int, int, int>> front;
    for (const uint32_t i : patch.cells) {
      ASSERT_EQ(i, next++);
      EXPECT_EQ(coarse.cells.Kind(i), patch.kind);
      const auto [x, y, z, kind, axis, negative] = GroupOf(coarse.cells[i], cube);
      left.emplace(x, y, z);
    }
    front.push_back(*left.begin());
    left.erase(left.begin());
    while (!front.empty()) {
      const auto [x, y, z] = front.back();
      front.pop_back();
      for (auto it = left.begin(); it != left.end();) {
        const auto [ox, oy, oz] = *it;
        const bool beside = std::max({std::abs(ox - x), std::abs(oy - y), std::abs(oz - z)}) <= 1;
        if (beside) front.push_back(*it);
        it = beside ? left.erase(it) : std::next(it);
      }
    }
    EXPECT_TRUE(left.empty());
  }
  EXPECT_EQ(next, coarse.cells.size());
}

// What is drawn at regular distances of a sum of many is near the sum.
TEST_P(CoarseCellsTest, ViewsScoreAboutTheSame) {
  parallel::Serial serial;
  const sensor::ScannerModel scanner;
  const auto fine = PlanningProblem::Prepare({model_, scanner, config_}, serial).value();
  const auto coarse =
      PlanningProblem::Prepare({model_, scanner, Coarse(GetParam())}, serial).value();
  ASSERT_EQ(fine->feasible().cells().size(), coarse->feasible().cells().size());
  const auto score = [](const PlanningProblem& problem, size_t view) {
    return problem.scoring()
        .scorer()
        .Score(problem.feasible().Centre(view), problem.scoring().cells(),
               parallel::Budget::Unlimited())
        .score;
  };
  size_t best_fine = 0;
  size_t best_coarse = 0;
  std::vector<double> exact;
  std::vector<double> about;
  for (size_t view = 0; view < fine->feasible().cells().size(); view += 7) {
    exact.push_back(score(*fine, view));
    about.push_back(score(*coarse, view));
    if (exact.back() > exact[best_fine]) best_fine = exact.size() - 1;
    if (about.back() > about[best_coarse]) best_coarse = about.size() - 1;
  }
  ASSERT_GT(exact.size(), 50u);
  double off = 0;
  for (size_t i = 0; i < exact.size(); ++i) off += std::abs(about[i] - exact[i]);
  off /= static_cast<double>(exact.size()) * exact[best_fine];
  // Half a per cent at each edge, of a room with a thousandth of the surface that is planned for
  // so.
  EXPECT_LT(off, 0.01);
  EXPECT_GT(exact[best_coarse], 0.98 * exact[best_fine]);
}

INSTANTIATE_TEST_SUITE_P(Cubes, CoarseCellsTest, ::testing::Values(2, 4, 8));

TEST(CubeShiftTest, IsTheLeastThatLeavesNoMore) {
  EXPECT_EQ(CubeShift(0, 1000), 0);
  EXPECT_EQ(CubeShift(1000, 1000), 0);
  EXPECT_EQ(CubeShift(1001, 1000), 1);
  for (const size_t deficient : {2000, 4000, 8000, 16000}) {
    const int shift = CubeShift(deficient, 1000);
    EXPECT_LE(CellsOfCubes(deficient, shift), 1000);
    EXPECT_GT(CellsOfCubes(deficient, shift - 1), 1000);
  }
  EXPECT_EQ(CubeShift(64'000'000, 1000), 3);  // bricks are the largest
}

}  // namespace
}  // namespace vantage::planning
