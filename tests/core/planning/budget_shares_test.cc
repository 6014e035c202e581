// How a plan's budget is shared: what is kept back for checks and answer follows the model.
#include "core/planning/budget_shares.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>

#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

using Clock = parallel::Budget::Clock;

Clock::time_point AtNoon() { return Clock::time_point(std::chrono::hours(12)); }

// s, of a deadline of `seconds`, that step D leaves.
double KeptBack(double seconds, double answer_seconds) {
  parallel::Budget budget;
  budget.now = &AtNoon;
  budget.deadline = AtNoon() + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(seconds));
  const parallel::Budget share = EvaluationShare(budget, answer_seconds);
  return std::chrono::duration<double>(budget.deadline - share.deadline).count();
}

TEST(BudgetSharesTest, WhatIsKeptBackFollowsWhatTheAnswerTakes) {
  constexpr double kNear = 1e-6;
  EXPECT_NEAR(KeptBack(60, 0.01), 0.4, kNear);
  EXPECT_NEAR(KeptBack(60, 4), 4, kNear);
  // A fifth of what is left at most, so that there is something to check.
  EXPECT_NEAR(KeptBack(1, 0.01), 0.2, kNear);
  EXPECT_NEAR(KeptBack(10, 4), 2, kNear);
  EXPECT_NEAR(KeptBack(-1, 4), 0, kNear);
}

TEST(BudgetSharesTest, AnAnswerTakesLongerTheMoreCellsThereAre) {
  PlanningConfig config;
  config.viewcell_size = 0.3;
  const test_support::PlanningProblem room(
      std::make_shared<model::PlanningView>(
          test_support::BuildView(test_support::FurnishedRoom(3))),
      config);
  const double one = AnswerSeconds(*room.problem, 1);
  EXPECT_GT(one, 0);
  EXPECT_LT(one, 0.8);  // of a room no more is kept back than ever
  EXPECT_NEAR(AnswerSeconds(*room.problem, 4), one / 4, 1e-9);
  config.candidates *= 3;
  config.max_checked *= 3;
  const test_support::PlanningProblem more(room.model, config);
  EXPECT_NEAR(AnswerSeconds(*more.problem, 1), 3 * one, 1e-9);
}

}  // namespace
}  // namespace vantage::planning
