// All evaluators of views of a scanner that sees a sector, against brute force over headings.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/evaluation/hierarchy.h"
#include "core/planning/evaluation/patch_order.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/sector_oracle.h"

namespace vantage::planning {
namespace {

struct SectorProblem : test_support::PlanningProblem {
  SectorProblem(int room, double span, double viewcell, double voxel = 0.05)
      : test_support::PlanningProblem(
            std::make_shared<model::PlanningView>(test_support::BuildView(SceneOf(room, voxel))),
            ConfigOf(viewcell), ScannerOf(span)) {
    const std::vector<double> angles = test_support::AnglesOf(headings());
    for (const Eigen::Vector3d& view : views) {
      truth.push_back(
          test_support::ScoreInSectors(scoring->scorer(), scoring->cells(), view, angles));
      test_support::SectorScore most;
      for (const test_support::SectorScore& score : truth.back()) {
        most.least = std::max(most.least, score.least);
        most.most = std::max(most.most, score.most);
      }
      best.push_back(most);
    }
  }
  static test_support::ClosedFormScene SceneOf(int room, double voxel) {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(static_cast<uint64_t>(room));
    scene.voxel = voxel;
    scene.density = [](const Eigen::Vector3d& p) {
      return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }
  static PlanningConfig ConfigOf(double viewcell) {
    PlanningConfig config;
    config.viewcell_size = viewcell;
    return config;
  }
  static sensor::ScannerModel ScannerOf(double span) {
    sensor::ScannerModel scanner;
    scanner.azimuth_span = sensor::Radians(span);
    return scanner;
  }
  const Headings& headings() const { return scoring->scorer().headings(); }
  void ExpectBest(size_t view, double score, size_t heading) const {
    constexpr double kRounded = 1e-6;
    EXPECT_GE(score, best[view].least * (1 - kRounded));
    EXPECT_LE(score, best[view].most * (1 + kRounded));
    EXPECT_GE(score, truth[view][heading].least * (1 - kRounded));
    EXPECT_LE(score, truth[view][heading].most * (1 + kRounded));
  }

  std::vector<std::vector<test_support::SectorScore>> truth;  // by view and heading
  std::vector<test_support::SectorScore> best;                // by view
};

class SectorEvaluationTest : public ::testing::TestWithParam<double> {
 protected:
  SectorEvaluationTest() : problem_(2, GetParam(), 0.4) {}
  void ExpectBestEverywhere(const Evaluation& evaluation) {
    ASSERT_TRUE(evaluation.complete);
    ASSERT_GT(problem_.views.size(), 30u);
    for (size_t i = 0; i < problem_.views.size(); ++i) {
      EXPECT_TRUE(evaluation.views[i].exact);
      problem_.ExpectBest(i, evaluation.views[i].score, evaluation.views[i].heading);
    }
  }
  SectorProblem problem_;
  parallel::Serial serial_;
};

TEST_P(SectorEvaluationTest, ViewByViewFindsTheBestHeading) {
  ExpectBestEverywhere(EvaluateViews(problem_.scoring->scorer(), problem_.feasible,
                                     static_cast<const CellArrays&>(problem_.scoring->cells()), {},
                                     parallel::Budget::Unlimited(), serial_,
                                     [](const Evaluation&) {}));
}

TEST_P(SectorEvaluationTest, TheHierarchyFindsTheBestHeading) {
  AnytimeOptions options;
  options.hierarchy_pairs = 0;
  ExpectBestEverywhere(EvaluateViews(
      problem_.scoring->scorer(), problem_.feasible, problem_.scoring->cells(), problem_.grid,
      options, parallel::Budget::Unlimited(), serial_, [](const Evaluation&) {}));
}

TEST_P(SectorEvaluationTest, ThePapersOrderFindsTheBestHeading) {
  HierarchyOptions options;
  options.tolerance = 0.02;
  ExpectBestEverywhere(EvaluateByPatches(
      problem_.scoring->scorer(), problem_.feasible, problem_.scoring->cells(), problem_.patches,
      problem_.grid, options, parallel::Budget::Unlimited(), serial_, [](const Evaluation&) {}));
}

TEST_P(SectorEvaluationTest, BlocksBoundTheirViewsBeyondWhatAllOfThemSeeTogether) {
  HierarchyOptions options;
  options.block_views = 16;
  double together = 0;
  double bounds = 0;
  const auto hierarchy = HierarchicalScorer::Create(
                             problem_.scoring->scorer(), problem_.grid, problem_.scoring->cells(),
                             problem_.feasible.cells(), problem_.feasible.cell_size(), options,
                             parallel::Budget::Unlimited(), serial_)
                             .value();
  for (const ViewBlock& block : hierarchy->blocks()) {
    double all = 0;
    for (const ViewBlock::Candidate& candidate : block.candidates) {
      all += hierarchy->patches()[candidate.node].potential;
    }
    EXPECT_LE(block.potential, all * (1 + 1e-9));
    together += all;
    bounds += block.potential;
    for (const uint32_t view : hierarchy->Views(block)) {
      EXPECT_LE(problem_.best[view].least, block.potential * (1 + 1e-6));
      const ViewScore score = hierarchy->ScoreView(view, parallel::Budget::Unlimited());
      problem_.ExpectBest(view, score.score, score.heading);
    }
  }
  EXPECT_TRUE(GetParam() > 60 || bounds < 0.8 * together) << bounds / together;
}

TEST_P(SectorEvaluationTest, IsTheSameOnAnyNumberOfThreads) {
  for (const uint64_t limit : {20'000u, 300'000u}) {
    parallel::Budget budget;
    budget.work_limit = limit;
    const auto evaluate = [&](parallel::Parallel& parallel) {
      return EvaluateViews(problem_.scoring->scorer(), problem_.feasible, problem_.scoring->cells(),
                           problem_.grid, {}, budget, parallel, [](const Evaluation&) {});
    };
    const Evaluation one = evaluate(serial_);
    parallel::ThreadPool pool(5);
    const Evaluation other = evaluate(pool);
    EXPECT_EQ(one.rays, other.rays);
    for (size_t i = 0; i < one.views.size(); ++i) {
      ASSERT_EQ(one.views[i].score, other.views[i].score);
      ASSERT_EQ(one.views[i].lower, other.views[i].lower);
      ASSERT_EQ(one.views[i].upper, other.views[i].upper);
      ASSERT_EQ(one.views[i].heading, other.views[i].heading);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Spans, SectorEvaluationTest, ::testing::Values(33.0, 120.0, 300.0));

// The best of many headings, each with its own luck in the sample: 100 short plans of each.
TEST(SectorHonestyTest, BoundsHoldForAllViewsWithTheirBestHeadings) {
  for (const double span : {20.0, 120.0}) {
    const SectorProblem problem(3, span, 0.3, 0.1);
    ASSERT_GT(problem.views.size(), 30u);
    parallel::Serial serial;
    int outside = 0;
    int informative = 0;
    for (uint64_t seed = 1; seed <= 100; ++seed) {
      AnytimeOptions options;
      options.seed = seed;
      options.race.first_draws = 60;
      parallel::Budget budget;
      budget.work_limit = (seed % 2 == 0 ? 10 : 60) * problem.views.size();
      const Evaluation evaluation =
          EvaluateViews(problem.scoring->scorer(), problem.feasible,
                        static_cast<const CellArrays&>(problem.scoring->cells()), options, budget,
                        serial, [](const Evaluation&) {});
      ASSERT_FALSE(evaluation.complete);
      bool holds = true;
      for (size_t i = 0; i < evaluation.views.size(); ++i) {
        const ViewEstimate& view = evaluation.views[i];
        const double slack = 1e-6 * problem.best[i].most;
        holds = holds && problem.best[i].most >= view.lower - slack &&
                problem.best[i].least <= view.upper + slack;
        informative += !view.exact && view.lower > 0.1 * view.upper;
      }
      outside += !holds;
    }
    EXPECT_LE(outside, 5) << span << " degrees";
    EXPECT_GT(informative, 100) << span << " degrees";
  }
}

}  // namespace
}  // namespace vantage::planning
