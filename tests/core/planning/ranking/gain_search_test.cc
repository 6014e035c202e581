// What the best view gains, against the gain of every view.
#include "core/planning/ranking/gain_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/scoring/gain_cells.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

class GainSearchTest : public ::testing::Test {
 protected:
  GainSearchTest() : view_(test_support::BuildView(Room(2))) { config_.viewcell_size = 0.4; }

  static test_support::ClosedFormScene Room(uint64_t seed) {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(seed);
    scene.density = [](const Eigen::Vector3d& p) {
      return 9000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }
  std::shared_ptr<const PlanningProblem> Prepare() {
    return PlanningProblem::Prepare({view_, scanner_, config_}, serial_).value();
  }
  // What every view gains, by its best heading.
  static std::vector<double> Gains(const PlanningProblem& problem, const CellArrays& gains) {
    const BruteForceScorer& scorer = problem.scoring().scorer();
    std::vector<double> by_view;
    std::vector<double> by_heading(scorer.headings().size());
    for (size_t i = 0; i < problem.feasible().cells().size(); ++i) {
      by_view.push_back(scorer
                            .ScoreHeadings(problem.feasible().Centre(i), gains,
                                           parallel::Budget::Unlimited(), by_heading)
                            .score);
    }
    return by_view;
  }
  // What the best view gains.
  double BestGain() {
    const auto problem = Prepare();
    const std::vector<double> by_view =
        Gains(*problem, GainCells(problem->scoring().cells(), problem->patches()));
    return by_view.empty() ? 0 : *std::max_element(by_view.begin(), by_view.end());
  }
  // Of scores of which nothing is known but that they are at most `most` (samples).
  static Evaluation NothingKnown(const PlanningProblem& problem, double most) {
    ViewEstimate unknown;
    unknown.upper = most;
    Evaluation evaluation;
    evaluation.views.assign(problem.feasible().cells().size(), unknown);
    return evaluation;
  }
  // Exact scores of all views, or bounds twice as high.
  static Evaluation AllViews(const PlanningProblem& problem, double slack) {
    Evaluation evaluation;
    for (size_t i = 0; i < problem.feasible().cells().size(); ++i) {
      const double score = problem.scoring()
                               .scorer()
                               .Score(problem.feasible().Centre(i), problem.scoring().cells(),
                                      parallel::Budget::Unlimited())
                               .score;
      evaluation.views.push_back({score, 0, slack * score, true, slack == 1, 0});
    }
    return evaluation;
  }
  GainBounds Bound(const PlanningProblem& problem, const Evaluation& evaluation,
                   const parallel::Budget& budget, parallel::Parallel& parallel) {
    const CellArrays gains = GainCells(problem.scoring().cells(), problem.patches());
    return BoundGainWithoutHidden({problem, problem.scoring().cells(), gains, evaluation, 0}, 0,
                                  budget, parallel);
  }
  // Bounds hold, and say whether any view gains enough, around the best gain.
  void ExpectJudged(double slack) {
    const auto problem = Prepare();
    const double best = BestGain();
    ASSERT_GT(best, 0);
    const Evaluation evaluation =
        slack > 0 ? AllViews(*problem, slack) : NothingKnown(*problem, 1e9);
    for (const double share : {0.3, 0.99, 1.01, 3.0}) {
      const double enough = share * best;
      config_.terminate_below = enough;
      const GainBounds bounds =
          Bound(*Prepare(), evaluation, parallel::Budget::Unlimited(), serial_);
      EXPECT_LE(bounds.lower, best * (1 + 1e-5)) << share;
      EXPECT_GE(bounds.upper, best * (1 - 1e-5)) << share;
      EXPECT_EQ(bounds.lower >= enough, share < 1) << bounds.lower << " of " << best;
      EXPECT_EQ(bounds.upper<enough, share> 1) << bounds.upper << " of " << best;
    }
  }

  model::PlanningView view_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

TEST_F(GainSearchTest, JudgesWhetherAnyViewGainsEnough) {
  for (const double slack : {0.0, 1.0, 2.0}) ExpectJudged(slack);
}

TEST_F(GainSearchTest, JudgesBySectorOfAScannerThatSeesOne) {
  scanner_.azimuth_span = sensor::Radians(100);
  ExpectJudged(0);
}

TEST_F(GainSearchTest, JudgesWithPoseSensitivity) {
  config_.pose_sensitivity = true;
  ExpectJudged(0);
}

// No sample is worth more than the bound that spares looking at views one by one.
TEST_F(GainSearchTest, ScoresBoundGains) {
  const auto problem = Prepare();
  const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
  const double per_sample = MostGainPerSample(problem->scoring().cells(), gains);
  const std::vector<double> by_view = Gains(*problem, gains);
  const Evaluation evaluation = AllViews(*problem, 1);
  for (size_t i = 0; i < by_view.size(); ++i) {
    EXPECT_LE(by_view[i], per_sample * evaluation.views[i].score * (1 + 1e-5));
  }
}

// By samples, in rooms that nothing was chosen on, for a fraction of the rays of all views: that
// none gains enough, and that one does.
TEST_F(GainSearchTest, SamplesSpareRaysAndTheirBoundsHold) {
  config_.viewcell_size = 0.3;
  uint64_t all_rays = 0;
  uint64_t rays = 0;
  for (uint64_t seed = 30; seed < 34; ++seed) {
    view_ = test_support::BuildView(Room(seed));
    config_.seed = seed;
    const auto problem = Prepare();
    const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
    const std::vector<double> by_view = Gains(*problem, gains);
    if (by_view.empty()) continue;
    const double best = *std::max_element(by_view.begin(), by_view.end());
    for (const ViewScore& score : ScoreEveryView(
             problem->scoring().scorer(),
             [&] {
               std::vector<Eigen::Vector3d> views;
               for (size_t i = 0; i < by_view.size(); ++i) {
                 views.push_back(problem->feasible().Centre(i));
               }
               return views;
             }(),
             gains, parallel::Budget::Unlimited(), serial_)) {
      all_rays += score.rays;
    }
    for (const double share : {0.5, 1.5}) {
      config_.terminate_below = share * best;
      const GainBounds bounds =
          Bound(*Prepare(), NothingKnown(*problem, 1e9), parallel::Budget::Unlimited(), serial_);
      EXPECT_LE(bounds.lower, best * (1 + 1e-5)) << seed;
      EXPECT_GE(bounds.upper, best * (1 - 1e-5)) << seed;
      EXPECT_EQ(bounds.upper<config_.terminate_below, share> 1) << seed;
      if (share > 1) rays += bounds.rays;
    }
  }
  EXPECT_LT(rays, all_rays / 3);
}

TEST_F(GainSearchTest, WithAWorkLimitItIsTheSameOnAnyNumberOfThreadsAndStillHolds) {
  const double best = BestGain();
  config_.terminate_below = 1.2 * best;
  const auto asked = Prepare();
  const Evaluation evaluation = AllViews(*asked, 2);
  const CellArrays gains = GainCells(asked->scoring().cells(), asked->patches());
  parallel::ThreadPool two(2);
  for (const uint64_t limit : {2000u, 20000u}) {
    parallel::Budget budget;
    budget.work_limit = limit;
    const GainBounds one = Bound(*asked, evaluation, budget, serial_);
    const GainBounds other = Bound(*asked, evaluation, budget, two);
    EXPECT_EQ(one.lower, other.lower);
    EXPECT_EQ(one.upper, other.upper);
    EXPECT_EQ(one.rays, other.rays);
    EXPECT_GE(one.upper, best);
    EXPECT_LE(one.rays, limit + 16 * asked->scoring().scorer().MostRays(gains));
  }
}

// A search that was interrupted comes to the same end.
TEST_F(GainSearchTest, GoesOnWhereItEnded) {
  config_.terminate_below = 1.02 * BestGain();
  const auto problem = Prepare();
  const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
  const Evaluation evaluation = NothingKnown(*problem, 1e9);
  const double per_sample = MostGainPerSample(problem->scoring().cells(), gains);
  GainSearch search(*problem, problem->scoring().cells(), gains, per_sample);
  uint64_t done = 0;
  double upper = search.Bounds(evaluation).upper;
  int searches = 0;
  for (; searches < 10000 && search.Bounds(evaluation).upper >= config_.terminate_below;
       ++searches) {
    // Of a clock that goes on by a second whenever somebody looks at it.
    static parallel::Budget::Clock::time_point at;
    parallel::Budget budget;
    budget.now = [] { return at += std::chrono::seconds(1); };
    budget.deadline = at + std::chrono::seconds(60);
    const uint64_t rays = search.Seek(evaluation, done, budget, serial_);
    EXPECT_LE(search.Bounds(evaluation).upper, upper);
    upper = search.Bounds(evaluation).upper;
    done += rays;
  }
  EXPECT_GT(searches, 1);
  EXPECT_LT(upper, config_.terminate_below);
  EXPECT_EQ(search.Seek(evaluation, 0, parallel::Budget::Unlimited(), serial_), 0u)
      << "nothing is left to look at";
}

// Where a budget is far from what an answer takes, it is left to those who can use it.
TEST_F(GainSearchTest, OnlyTheBestViewIsLookedAtWhereAnAnswerIsOutOfReach) {
  config_.terminate_below = 1.02 * BestGain();
  const auto problem = Prepare();
  const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
  parallel::Budget budget;
  budget.work_limit = 500;
  const GainBounds bounds = Bound(*problem, NothingKnown(*problem, 1e9), budget, serial_);
  EXPECT_LE(bounds.rays, problem->scoring().scorer().MostRays(gains));
  EXPECT_GE(bounds.upper, config_.terminate_below);
}

// What somebody knows already is not looked for.
TEST_F(GainSearchTest, NothingIsLookedAtWhenAViewIsKnownToGainEnough) {
  const auto problem = Prepare();
  const Evaluation evaluation = AllViews(*problem, 1);
  const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
  const GainBounds bounds = BoundGainWithoutHidden(
      {*problem, problem->scoring().cells(), gains, evaluation, config_.terminate_below}, 0,
      parallel::Budget::Unlimited(), serial_);
  EXPECT_EQ(bounds.rays, 0u);
  EXPECT_EQ(bounds.lower, config_.terminate_below);
}

}  // namespace
}  // namespace vantage::planning
