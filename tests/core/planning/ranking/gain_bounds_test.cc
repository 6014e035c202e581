// The model gain of views against a sum over voxels.
#include "core/planning/ranking/gain_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

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

}  // namespace
}  // namespace vantage::planning
