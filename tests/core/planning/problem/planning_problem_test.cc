#include "core/planning/problem/planning_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/planner.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using ::testing::HasSubstr;

class PlanningProblemTest : public ::testing::Test {
 protected:
  PlanningProblemTest() : model_(test_support::BuildView(test_support::FurnishedRoom(3))) {
    config_.viewcell_size = 0.2;
    config_.registration.required_accuracy = 0.1;
    config_.registration.minimum_overlap = 0.01;
  }
  std::shared_ptr<const PlanningProblem> Prepare(const PlanningProblem* previous = nullptr) {
    return Prepare(model_, previous);
  }
  std::shared_ptr<const PlanningProblem> Prepare(const model::PlanningView& model,
                                                 const PlanningProblem* previous) {
    auto problem = PlanningProblem::Prepare({model, scanner_, config_, previous}, serial_);
    EXPECT_TRUE(problem.ok()) << problem.status();
    return *std::move(problem);
  }

  // To the bit: where one may stand, what is lacking, and what views score on it.
  static void ExpectSame(const PlanningProblem& a, const PlanningProblem& b) {
    ASSERT_EQ(a.feasible().cells(), b.feasible().cells());
    ASSERT_FALSE(a.feasible().cells().empty());
    EXPECT_EQ(a.feasible().counts(), b.feasible().counts());
    ASSERT_EQ(a.patches().cells.size(), b.patches().cells.size());
    EXPECT_EQ(a.patches().area, b.patches().area);
    for (size_t i = 0; i < a.patches().cells.size(); ++i) {
      ASSERT_EQ(a.patches().cells[i].voxel, b.patches().cells[i].voxel);
      ASSERT_EQ(a.patches().cells[i].enough, b.patches().cells[i].enough);
    }
    EXPECT_EQ(a.coverage().area_at_density, b.coverage().area_at_density);
    ASSERT_EQ(a.scoring().cells().cell, b.scoring().cells().cell);
    const size_t step = a.feasible().cells().size() / 20 + 1;
    for (size_t i = 0; i < a.feasible().cells().size(); i += step) {
      EXPECT_EQ(ScoreOf(a, i), ScoreOf(b, i)) << i;
    }
  }
  static double ScoreOf(const PlanningProblem& problem, size_t view) {
    return problem.scoring()
        .scorer()
        .Score(problem.feasible().Centre(view), problem.scoring().cells(),
               parallel::Budget::Unlimited())
        .score;
  }

  model::PlanningView model_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

TEST_F(PlanningProblemTest, FromAPreviousOneItIsTheSameAsFromScratch) {
  const auto previous = Prepare();
  {
    SCOPED_TRACE("another scanner");
    scanner_.clearance = 0.5;
    scanner_.range_max = 4;
    ExpectSame(*Prepare(previous.get()), *Prepare());
  }
  {
    SCOPED_TRACE("cubes");
    config_.max_cells = 1000;
    ExpectSame(*Prepare(previous.get()), *Prepare());
    config_.max_cells = PlanningConfig().max_cells;
  }
  {
    SCOPED_TRACE("what surface is worth");
    config_.weights = {1, 0, 2, 0.5};
    config_.unknown_depth = 0;
    ExpectSame(*Prepare(previous.get()), *Prepare());
  }
  {
    SCOPED_TRACE("where one may stand");
    config_.keep_out.emplace_back(Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(2, 2, 3));
    ExpectSame(*Prepare(previous.get()), *Prepare());
  }
  {
    SCOPED_TRACE("a region");
    config_.region_of_interest = Region(Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(3, 4, 3));
    ExpectSame(*Prepare(previous.get()), *Prepare());
  }
  {
    SCOPED_TRACE("another model");
    const model::PlanningView other = test_support::BuildView(test_support::FurnishedRoom(5));
    ExpectSame(*Prepare(other, previous.get()), *Prepare(other, nullptr));
  }
}

TEST_F(PlanningProblemTest, SharesWhatDoesNotDependOnTheScanner) {
  const auto previous = Prepare();
  scanner_.range_max = 5;
  const auto next = Prepare(previous.get());
  EXPECT_EQ(&next->scene(), &previous->scene());
  EXPECT_EQ(&next->patches(), &previous->patches());
  config_.required_density *= 2;
  EXPECT_NE(&Prepare(previous.get())->patches(), &previous->patches());
}

TEST_F(PlanningProblemTest, OutlivesTheOneThatItSharesWith) {
  auto previous = Prepare();
  const auto next = Prepare(previous.get());
  const double before = ScoreOf(*next, 0);
  previous.reset();
  EXPECT_EQ(ScoreOf(*next, 0), before);
}

TEST_F(PlanningProblemTest, PlansFromItAreThoseFromTheModel) {
  parallel::Budget budget;
  budget.work_limit = 2'000'000;
  const auto nobody = [](const Plan&) {};
  const Plan whole = MakePlan(model_, scanner_, config_, budget, serial_, nobody).value();
  ASSERT_FALSE(whole.views.empty());
  const auto problem = Prepare();
  parallel::ThreadPool pool(3);
  for (int k = 0; k < 2; ++k) {  // a problem is not used up
    const Plan plan = MakePlan(*problem, budget, pool, nobody);
    ASSERT_EQ(plan.views.size(), whole.views.size());
    for (size_t i = 0; i < plan.views.size(); ++i) {
      EXPECT_EQ(plan.views[i].position, whole.views[i].position);
      EXPECT_EQ(plan.views[i].score, whole.views[i].score);
    }
    EXPECT_EQ(plan.rays, whole.rays);
    EXPECT_EQ(plan.message, whole.message);
    EXPECT_EQ(plan.deficient_area, whole.deficient_area);
  }
  const Eigen::Vector3d at = whole.views[0].position;
  EXPECT_EQ(EvaluateView(*problem, at)->view.score,
            EvaluateView(model_, scanner_, config_, at, serial_)->view.score);
}

TEST_F(PlanningProblemTest, SaysWhatIsImpossible) {
  PlanningConfig impossible = config_;
  impossible.required_density = -1;
  const auto invalid = PlanningProblem::Prepare({model_, scanner_, impossible}, serial_);
  EXPECT_EQ(invalid.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(invalid.status().message(), HasSubstr("required_density"));
  PlanningConfig small = config_;
  small.memory_limit = 1000;
  const auto large = PlanningProblem::Prepare({model_, scanner_, small}, serial_);
  EXPECT_EQ(large.status().code(), absl::StatusCode::kResourceExhausted);
  std::stop_source source;
  source.request_stop();
  const auto cancelled = PlanningProblem::Prepare({model_, scanner_, config_}, serial_,
                                                  parallel::Cancellation(source.get_token()));
  EXPECT_EQ(cancelled.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(cancelled.status().message(), "feasible views");
}

TEST_F(PlanningProblemTest, OfAnEmptyModelNothingIsFeasibleOrDeficient) {
  const model::PlanningView empty(0.05, 1, {}, {});
  const auto problem = Prepare(empty, nullptr);
  EXPECT_TRUE(problem->feasible().cells().empty());
  EXPECT_TRUE(problem->patches().cells.empty());
  EXPECT_EQ(problem->scoring().cells().size(), 0u);
}

}  // namespace
}  // namespace vantage::planning
