// The model gain of views against a sum over voxels, and its bounds against all views.
#include "core/planning/ranking/gain_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/patches/space_behind.h"
#include "core/planning/ranking/gain_forecast.h"
#include "core/planning/ranking/view_report.h"
#include "core/planning/scoring/gain_cells.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

class GainBoundsTest : public ::testing::Test {
 protected:
  GainBoundsTest() : view_(test_support::BuildView(Room())) { config_.viewcell_size = 0.4; }
  static test_support::ClosedFormScene Room() {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(2);
    scene.density = [](const Eigen::Vector3d& p) {
      return 9000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }
  std::shared_ptr<const PlanningProblem> Prepare() {
    return PlanningProblem::Prepare({view_, scanner_, config_}, serial_).value();
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
  bool IsDeep(const DeficientCell& cell) const {
    return cell.kind != model::SurfaceKind::kHole &&
           DepthBehind(view_, cell.voxel, cell.normal, config_.unknown_depth) >= kDeep;
  }
  // Area of the cells that the view brings to D, voxel by voxel.
  GainParts BruteForce(const PlanningProblem& problem, const Eigen::Vector3d& view) const {
    const CellArrays& cells = problem.scoring().cells();
    std::vector<float> scores(cells.size());
    (void)problem.scoring().scorer().ScoreCells(view, cells, parallel::Budget::Unlimited(), scores);
    GainParts parts;
    for (size_t i = 0; i < cells.size(); ++i) {
      if (scores[i] <= 0) continue;  // not seen
      const DeficientCell& cell = problem.patches().cells[cells.cell[i]];
      const Eigen::Vector3d to = view - cell.position.cast<double>();
      const double cosine = to.normalized().dot(cell.normal.cast<double>());
      const double density =
          scanner_.SamplingDensity(std::asin(-to.z() / to.norm()), cosine, to.norm());
      if (density >= config_.required_density * static_cast<double>(cell.spread)) {
        (cell.kind == model::SurfaceKind::kTrue ? parts.measured
         : IsDeep(cell)                         ? parts.deep
                        : parts.hidden) += static_cast<double>(cell.success * cell.area);
      }
    }
    return parts;
  }

  model::PlanningView view_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

TEST_F(GainBoundsTest, GainIsTheAreaThatComesToTheRequiredDensity) {
  const auto problem = Prepare();
  const ViewReport report(*problem);
  double most = 0;
  double most_hidden = 0;
  double most_deep = 0;
  for (size_t i = 0; i < problem->feasible().cells().size(); i += 7) {
    RankedView view;
    const Eigen::Vector3d at = problem->feasible().Centre(i);
    ASSERT_TRUE(report.Exact(at, parallel::Budget::Unlimited(), serial_, view));
    const GainParts parts = BruteForce(*problem, at);
    const double area = parts.measured + parts.hidden + parts.deep;
    const double expected = ForecastGain(parts).expected;
    // Cells between 0.99 D and D count in part.
    EXPECT_NEAR(view.model_gain.value(), area, 0.02 * area + 0.01);
    EXPECT_NEAR(view.expected_gain.value(), expected, 0.02 * expected + 0.01);
    EXPECT_EQ(view.gain_without_hidden.value(), view.model_gain.value()) << "nothing is expected";
    most = std::max(most, area);
    most_hidden = std::max(most_hidden, parts.hidden);
    most_deep = std::max(most_deep, parts.deep);
  }
  EXPECT_GT(most, 1);
  EXPECT_GT(most_hidden, 0.5);
  EXPECT_GT(most_deep, 0);
}

// What lies behind an opening and what is weighed differently change scores, not square metres.
TEST_F(GainBoundsTest, WeightsAndUnknownSpaceBehindDoNotCount) {
  const Eigen::Vector3d at = Prepare()->feasible().Centre(Prepare()->feasible().cells().size() / 2);
  const auto of = [&] {
    const auto problem = Prepare();
    RankedView view;
    EXPECT_TRUE(ViewReport(*problem).Exact(at, parallel::Budget::Unlimited(), serial_, view));
    return view;
  };
  const RankedView usual = of();
  config_.weights = {2, 3, 0.5, 4};
  config_.unknown_depth = 0;
  config_.min_deficit_share = 0;
  const RankedView other = of();
  EXPECT_NE(other.score, usual.score);
  EXPECT_NEAR(other.model_gain.value(), usual.model_gain.value(), 1e-5);
}

TEST_F(GainBoundsTest, HoldTheBestOfAllViews) {
  const auto problem = Prepare();
  const CellArrays gains = GainCells(problem->scoring().cells(), problem->patches());
  double best = 0;
  double best_score = 0;
  for (size_t i = 0; i < problem->feasible().cells().size(); ++i) {
    const Eigen::Vector3d at = problem->feasible().Centre(i);
    const auto unlimited = parallel::Budget::Unlimited();
    best = std::max(best, problem->scoring().scorer().Score(at, gains, unlimited).score);
    best_score = std::max(
        best_score,
        problem->scoring().scorer().Score(at, problem->scoring().cells(), unlimited).score);
  }
  // As many samples at most: the bound that spares looking at views one by one.
  EXPECT_LE(best, MostGainPerSample(problem->scoring().cells(), gains) * best_score);
  for (const double slack : {1.0, 2.0}) {
    const Evaluation evaluation = AllViews(*problem, slack);
    for (const double enough : {0.5 * best, 0.99 * best, 1.01 * best, 2 * best}) {
      config_.terminate_below = enough;
      const auto asked = Prepare();
      const GainBounds bounds =
          BoundGainWithoutHidden({*asked, asked->scoring().cells(), gains, evaluation, 0}, 0,
                                 parallel::Budget::Unlimited(), serial_);
      EXPECT_LE(bounds.lower, best * (1 + 1e-9));
      EXPECT_GE(bounds.upper, best * (1 - 1e-9));
      EXPECT_EQ(bounds.lower >= enough, best >= enough) << enough;
      EXPECT_EQ(bounds.upper < enough, best < enough) << enough;
    }
  }
}

TEST_F(GainBoundsTest, WithAWorkLimitTheyAreTheSameOnAnyNumberOfThreadsAndStillHold) {
  const auto problem = Prepare();
  const Evaluation evaluation = AllViews(*problem, 2);
  config_.terminate_below = 1000;
  const auto asked = Prepare();
  parallel::Budget budget;
  budget.work_limit = 2000;
  parallel::ThreadPool two(2);
  const CellArrays gains = GainCells(asked->scoring().cells(), asked->patches());
  const GainQuestion question = {*asked, asked->scoring().cells(), gains, evaluation, 0};
  const GainBounds one = BoundGainWithoutHidden(question, 0, budget, serial_);
  const GainBounds other = BoundGainWithoutHidden(question, 0, budget, two);
  EXPECT_EQ(one.lower, other.lower);
  EXPECT_EQ(one.upper, other.upper);
  EXPECT_EQ(one.rays, other.rays);
}

// What somebody knows already is not looked for.
TEST_F(GainBoundsTest, NothingIsLookedAtWhenAViewIsKnownToGainEnough) {
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
