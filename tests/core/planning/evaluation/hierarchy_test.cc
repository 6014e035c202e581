// The hierarchical scorer against brute force.
#include "core/planning/evaluation/hierarchy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/anytime.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/scanned_office.h"

namespace vantage::planning {
namespace {

// As if rays from a place to every third surface voxel had dropped out.
std::shared_ptr<const model::PlanningView> DroppedOut(const model::PlanningView& view,
                                                      const Eigen::Vector3f& from) {
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : view.bricks()) {
    auto brick = std::make_shared<model::Brick>(*at.contents);
    for (uint32_t local = 0; local < model::Brick::kVoxels; local += 3) {
      if (brick->Surface(static_cast<int>(local)).has_value())
        brick->dropouts.push_back({from, local});
    }
    std::stable_sort(
        brick->dropouts.begin(), brick->dropouts.end(),
        [](const model::Dropout& a, const model::Dropout& b) { return a.local < b.local; });
    bricks.push_back({at.brick, std::move(brick)});
  }
  return std::make_shared<model::PlanningView>(view.voxel_size(), view.version(), std::move(bricks),
                                               view.stations());
}

// As if there were the open sky instead of a ceiling and of the walls above `height`, m.
std::shared_ptr<const model::PlanningView> UnderTheSky(const model::PlanningView& view,
                                                       double height) {
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : view.bricks()) {
    auto brick = std::make_shared<model::Brick>(*at.contents);
    brick->surface.clear();
    brick->dropouts.clear();
    for (int local = 0; local < model::Brick::kVoxels; ++local) {
      const std::optional<model::SurfaceVoxel> surface = at.contents->Surface(local);
      if (view.Centre(model::PlanningView::Global(at.brick, local)).z() > height) {
        brick->state[static_cast<size_t>(local)] = model::VoxelState::kUnknown;
        brick->surface_mask[static_cast<size_t>(local / 64)] &= ~(uint64_t{1} << (local % 64));
      } else if (surface.has_value()) {
        brick->surface.push_back(*surface);
      }
    }
    bricks.push_back({at.brick, std::move(brick)});
  }
  return std::make_shared<model::PlanningView>(view.voxel_size(), view.version(), std::move(bricks),
                                               view.stations());
}

struct Problem : test_support::PlanningProblem {
  using test_support::PlanningProblem::PlanningProblem;
  std::unique_ptr<HierarchicalScorer> Hierarchy(const HierarchyOptions& options) {
    return HierarchicalScorer::Create(scoring->scorer(), grid, scoring->cells(), feasible.cells(),
                                      feasible.cell_size(), options, parallel::Budget::Unlimited(),
                                      serial)
        .value();
  }
  std::vector<ViewScore> BruteForce() const {
    parallel::ThreadPool pool(2);
    return test_support::PlanningProblem::BruteForce(pool);
  }
};

struct Difference {
  double rms = 0;  // relative to brute force's root mean square
  double most = 0;
  uint64_t rays = 0;        // of the hierarchy
  uint64_t brute_rays = 0;  // of brute force
};

Difference Compare(const std::vector<ViewScore>& brute, const std::vector<ViewScore>& scores) {
  Difference difference;
  double reference = 0;
  for (size_t i = 0; i < brute.size(); ++i) {
    EXPECT_TRUE(scores[i].finished);
    const double off = scores[i].score - brute[i].score;
    difference.rms += off * off;
    reference += brute[i].score * brute[i].score;
    difference.most = std::max(difference.most, std::abs(off) / (brute[i].score + 1e-9));
    difference.rays += scores[i].rays;
    difference.brute_rays += brute[i].rays;
  }
  EXPECT_GT(reference, 0);
  difference.rms = std::sqrt(difference.rms / reference);
  return difference;
}

// The hierarchy scores as brute force does, whether its leaves are single views or many.
void ExpectSameByLeaves(Problem& problem, const std::vector<ViewScore>& brute) {
  for (const uint32_t leaf : {1u, 16u}) {
    HierarchyOptions options;
    options.leaf_views = leaf;
    const auto hierarchy = problem.Hierarchy(options);
    const std::vector<ViewScore> scores =
        ScoreEveryView(*hierarchy, parallel::Budget::Unlimited(), problem.serial);
    EXPECT_LT(Compare(brute, scores).most, 1e-6) << "leaves of " << leaf;
  }
}

class HierarchyTest : public ::testing::TestWithParam<int> {
 protected:
  std::unique_ptr<Problem> MakeProblem(bool pose_sensitivity = false) {
    PlanningConfig config;
    config.viewcell_size = GetParam() == 0 ? 0.3 : 0.2;
    config.pose_sensitivity = pose_sensitivity;
    config.weights = {1, 2, 0.5, 1};
    config.unknown_depth = GetParam() % 2 == 0 ? 0 : 2;
    if (GetParam() == 0) {
      return std::make_unique<Problem>(test_support::ScannedOffice(), config);
    }
    test_support::ClosedFormScene scene =
        test_support::FurnishedRoom(static_cast<uint64_t>(GetParam()));
    scene.density = [](const Eigen::Vector3d& p) {
      return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return std::make_unique<Problem>(
        std::make_shared<model::PlanningView>(test_support::BuildView(scene)), config);
  }
};

TEST_P(HierarchyTest, IsBruteForceWhereRaysDroppedOut) {
  const auto plain = MakeProblem();
  const Eigen::Vector3f from = plain->views[plain->views.size() / 2].cast<float>();
  Problem problem(DroppedOut(*plain->model, from), plain->config);
  ASSERT_EQ(problem.views.size(), plain->views.size());
  const std::vector<ViewScore> without = plain->BruteForce();
  const std::vector<ViewScore> brute = problem.BruteForce();
  double lost_there = 0;  // share of the gain
  for (size_t i = 0; i < brute.size(); ++i) {
    EXPECT_LE(brute[i].score, without[i].score * (1 + 1e-6));
    if ((problem.views[i].cast<float>() - from).norm() > 0.01f) continue;
    lost_there = 1 - brute[i].score / without[i].score;
  }
  EXPECT_GT(lost_there, 0.1);
  ExpectSameByLeaves(problem, brute);
}

TEST_P(HierarchyTest, IsBruteForceUnderTheSky) {
  const auto plain = MakeProblem();
  Problem problem(UnderTheSky(*plain->model, 2.2), plain->config);
  ASSERT_GT(problem.views.size(), 100u);
  size_t limited = 0;
  for (const float steepest : problem.scoring->cells().steepest) {
    limited += steepest < CellArrays::kAnyRay ? 1 : 0;
  }
  EXPECT_GT(limited, 20u);
  const std::vector<ViewScore> brute = problem.BruteForce();
  ExpectSameByLeaves(problem, brute);
}

TEST_P(HierarchyTest, IsBruteForceUpToRounding) {
  const auto problem = MakeProblem();
  ASSERT_GT(problem->views.size(), 100u);
  const std::vector<ViewScore> brute = problem->BruteForce();
  for (const uint32_t leaf : {1u, 16u}) {
    HierarchyOptions options;
    options.leaf_views = leaf;
    const auto hierarchy = problem->Hierarchy(options);
    const std::vector<ViewScore> scores =
        ScoreEveryView(*hierarchy, parallel::Budget::Unlimited(), problem->serial);
    const Difference difference = Compare(brute, scores);
    EXPECT_LT(difference.most, 1e-6) << "leaves of " << leaf;
    EXPECT_LT(difference.rays, difference.brute_rays);
  }
}

TEST_P(HierarchyTest, StaysWithinATenthOfAPercentAtTheDefaultTolerance) {
  const auto problem = MakeProblem();
  HierarchyOptions options;
  options.tolerance = problem->config.density_tolerance;
  options.leaf_views = 1;
  const auto hierarchy = problem->Hierarchy(options);
  const Difference difference =
      Compare(problem->BruteForce(),
              ScoreEveryView(*hierarchy, parallel::Budget::Unlimited(), problem->serial));
  EXPECT_LT(difference.rms, 1e-3);
}

TEST_P(HierarchyTest, CountsOnlyWhatEveryPoseSees) {
  const auto problem = MakeProblem(true);
  HierarchyOptions options;
  options.block_views = 32;
  const auto hierarchy = problem->Hierarchy(options);
  const size_t blocks = hierarchy->blocks().size();
  double sum = 0;
  for (size_t b = 0; b < blocks; b += blocks / 3) {
    const ViewBlock& block = hierarchy->blocks()[b];
    const auto views = hierarchy->Views(block);
    std::vector<ViewScore> scores(views.size());
    hierarchy->ScoreBlock(block, parallel::Budget::Unlimited(), scores);
    for (size_t k = 0; k < views.size(); k += 4) {
      const double gain = problem->scoring->scorer()
                              .Score(problem->views[views[k]], problem->scoring->cells(),
                                     parallel::Budget::Unlimited())
                              .score;
      EXPECT_NEAR(scores[k].score, gain, 1e-6 * gain);
      sum += gain;
    }
  }
  EXPECT_GT(sum, 0);
}

TEST_P(HierarchyTest, BlocksBoundTheirViews) {
  const auto problem = MakeProblem();
  const std::vector<ViewScore> brute = problem->BruteForce();
  const auto hierarchy = problem->Hierarchy({});
  size_t views = 0;
  double best = 0;
  for (const ViewScore& score : brute) best = std::max(best, score.score);
  for (const ViewBlock& block : hierarchy->blocks()) {
    EXPECT_LT(block.potential, 20 * best);  // or the bounds say nothing
    for (const uint32_t view : hierarchy->Views(block)) {
      ++views;
      EXPECT_GE(brute[view].score, block.certain * (1 - 1e-6));
      EXPECT_LE(brute[view].score, block.potential * (1 + 1e-6));
    }
    for (const uint32_t view : hierarchy->Views(block).first(1)) {
      EXPECT_NEAR(hierarchy->ScoreView(view, parallel::Budget::Unlimited()).score,
                  brute[view].score, 1e-6 * (1 + brute[view].score));
    }
  }
  EXPECT_EQ(views, problem->views.size());
}

TEST_P(HierarchyTest, IsTheSameOnAnyNumberOfThreads) {
  const auto problem = MakeProblem();
  const auto one =
      ScoreEveryView(*problem->Hierarchy({}), parallel::Budget::Unlimited(), problem->serial);
  parallel::ThreadPool pool(5);
  const auto five = ScoreEveryView(*problem->Hierarchy({}), parallel::Budget::Unlimited(), pool);
  ASSERT_EQ(one.size(), five.size());
  for (size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].score, five[i].score);
    ASSERT_EQ(one[i].rays, five[i].rays);
  }
}

TEST_P(HierarchyTest, StopsWhenCancelled) {
  const auto problem = MakeProblem();
  const auto hierarchy = problem->Hierarchy({});
  std::stop_source stop;
  parallel::Budget budget;
  budget.cancelled = stop.get_token();
  stop.request_stop();
  const ViewBlock& block = hierarchy->blocks().front();
  std::vector<ViewScore> scores(hierarchy->Views(block).size());
  hierarchy->ScoreBlock(block, budget, scores);
  for (const ViewScore& score : scores) EXPECT_FALSE(score.finished);
}

TEST_P(HierarchyTest, CompletesAnAnytimeEvaluation) {
  const auto problem = MakeProblem();
  const OrderedCells& cells = problem->scoring->cells();
  parallel::ThreadPool pool(3);
  std::vector<std::atomic<uint8_t>> seen(problem->patches.cells.size());
  std::vector<ViewScore> brute(problem->views.size());
  pool.For(brute.size(), [&](size_t i) {
    brute[i] = problem->scoring->scorer().Score(problem->views[i], cells,
                                                parallel::Budget::Unlimited(), seen);
  });
  AnytimeOptions options;
  options.hierarchy_pairs = 0;
  const auto evaluate = [&](const parallel::Budget& budget, parallel::Parallel& parallel) {
    return EvaluateViews(problem->scoring->scorer(), problem->feasible, cells, problem->grid,
                         options, budget, parallel, [](const Evaluation&) {});
  };
  const Evaluation all = evaluate(parallel::Budget::Unlimited(), pool);
  EXPECT_TRUE(all.complete);
  EXPECT_EQ(all.exact, problem->views.size());
  ASSERT_EQ(all.seen.size(), seen.size());
  for (size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(all.seen[i], seen[i]);
  uint64_t dearest = 0;
  for (size_t i = 0; i < brute.size(); ++i) {
    EXPECT_TRUE(all.views[i].exact);
    EXPECT_NEAR(all.views[i].score, brute[i].score, 1e-6 * (1 + brute[i].score));
    dearest = std::max(dearest, brute[i].rays);
  }
  // Stopped anywhere, bounds hold, the limit is kept and threads don't show.
  for (const double share : {0.4, 0.8}) {
    parallel::Budget budget;
    budget.work_limit = static_cast<uint64_t>(share * static_cast<double>(all.rays));
    const Evaluation some = evaluate(budget, problem->serial);
    const Evaluation again = evaluate(budget, pool);
    EXPECT_LE(some.rays, budget.work_limit + dearest);
    EXPECT_EQ(some.rays, again.rays);
    EXPECT_FALSE(some.complete);
    size_t outside = 0;
    for (size_t i = 0; i < brute.size(); ++i) {
      const ViewEstimate& view = some.views[i];
      ASSERT_EQ(view.score, again.views[i].score);
      ASSERT_EQ(view.lower, again.views[i].lower);
      ASSERT_EQ(view.upper, again.views[i].upper);
      outside +=
          brute[i].score > view.upper * (1 + 1e-6) || brute[i].score < view.lower * (1 - 1e-6);
    }
    EXPECT_EQ(outside, 0u) << "of the work " << share;  // at 95 % for all of them together
  }
}

// 0: the office; otherwise the furnished room of that seed.
INSTANTIATE_TEST_SUITE_P(Scenes, HierarchyTest, ::testing::Values(0, 5, 6));

}  // namespace
}  // namespace vantage::planning
