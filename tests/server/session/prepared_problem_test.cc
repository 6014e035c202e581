#include "server/session/prepared_problem.h"

#include <gtest/gtest.h>

#include <memory>

#include "absl/status/status.h"
#include "core/parallel/parallel.h"
#include "core/planning/planner.h"
#include "tests/support/closed_form_view.h"

namespace vantage::session {
namespace {

class PreparedProblemTest : public ::testing::Test {
 protected:
  PreparedProblemTest() {
    question_.view = View(3);
    question_.config.viewcell_size = 0.25;
    question_.written = "written";
  }
  static std::shared_ptr<const model::PlanningView> View(uint64_t seed) {
    return std::make_shared<model::PlanningView>(
        test_support::BuildView(test_support::FurnishedRoom(seed)));
  }
  std::shared_ptr<MemoryAccount::Reservation> Reserve() {
    return std::make_shared<MemoryAccount::Reservation>(*account_.Take("", 100));
  }
  std::shared_ptr<const planning::PlanningProblem> Of(const ProblemQuestion& question) {
    return prepared_.Of(question, Reserve(), serial_, {}).value();
  }

  parallel::Serial serial_;
  MemoryAccount account_{1000};
  ProblemQuestion question_;
  PreparedProblem prepared_;
};

TEST_F(PreparedProblemTest, IsThereForWhoAsksTheSame) {
  const auto first = Of(question_);
  EXPECT_EQ(account_.used(), 100);
  EXPECT_EQ(Of(question_), first);
  EXPECT_EQ(account_.used(), 100);  // what the second reserved is not kept
}

TEST_F(PreparedProblemTest, IsMadeAnewWhereAnythingDiffersAndSharesTheRest) {
  const auto first = Of(question_);
  ProblemQuestion other = question_;
  other.config.seed = 2;
  const auto seeded = Of(other);
  EXPECT_NE(seeded, first);
  EXPECT_EQ(seeded->config().seed, 2u);
  EXPECT_EQ(&seeded->scene(), &first->scene());
  other = question_;
  other.scanner.range_max = 7;
  EXPECT_EQ(Of(other)->scanner().range_max, 7);
  other = question_;
  other.written = "denser";
  other.config.required_density = 5000;
  EXPECT_EQ(Of(other)->config().required_density, 5000);
  other = question_;
  other.view = View(4);
  EXPECT_EQ(&Of(other)->model(), other.view.get());
  EXPECT_EQ(account_.used(), 100);
}

// As from scratch, to the bit.
TEST_F(PreparedProblemTest, PlansAsIfItWereNew) {
  parallel::Budget budget;
  budget.work_limit = 500'000;
  (void)Of(question_);
  ProblemQuestion other = question_;
  other.config.seed = 7;
  const auto make = [&](const planning::PlanningProblem& problem) {
    return planning::MakePlan(problem, budget, serial_, [](const planning::Plan&) {});
  };
  const planning::Plan shared = make(*Of(other));
  PreparedProblem fresh;
  const planning::Plan alone = make(*fresh.Of(other, nullptr, serial_, {}).value());
  ASSERT_FALSE(shared.views.empty());
  ASSERT_EQ(shared.views.size(), alone.views.size());
  for (size_t i = 0; i < shared.views.size(); ++i) {
    EXPECT_EQ(shared.views[i].position, alone.views[i].position);
    EXPECT_EQ(shared.views[i].score, alone.views[i].score);
  }
  EXPECT_EQ(shared.rays, alone.rays);
}

TEST_F(PreparedProblemTest, GivesItsMemoryBackWhenNobodyPlansWithIt) {
  EXPECT_EQ(prepared_.Forget(), 0);
  std::shared_ptr<MemoryAccount::Reservation> plans = Reserve();
  auto problem = prepared_.Of(question_, plans, serial_, {}).value();
  EXPECT_EQ(prepared_.Forget(), 0);  // the plan's own
  EXPECT_EQ(account_.used(), 100);
  EXPECT_EQ(prepared_.Of(question_, plans, serial_, {}).value()->config().seed, 1u);
  plans.reset();
  problem.reset();
  EXPECT_EQ(prepared_.Forget(), 100);
  EXPECT_EQ(account_.used(), 0);
}

// Forgets while a problem is being made: its model is gone, or memory is short.
class ForgettingParallel final : public parallel::Parallel {
 public:
  explicit ForgettingParallel(PreparedProblem& prepared) : prepared_(prepared) {}
  int width() const override { return 1; }
  void For(size_t count, absl::FunctionRef<void(size_t)> body) override {
    (void)prepared_.Forget();
    for (size_t i = 0; i < count; ++i) body(i);
  }

 private:
  PreparedProblem& prepared_;
};

TEST_F(PreparedProblemTest, IsNotKeptWhenItWasToBeForgottenMeanwhile) {
  ForgettingParallel forgetting(prepared_);
  ASSERT_TRUE(prepared_.Of(question_, Reserve(), forgetting, {}).ok());
  EXPECT_EQ(account_.used(), 0);
}

TEST_F(PreparedProblemTest, WhatIsCancelledOrImpossibleLeavesTheLast) {
  const auto first = Of(question_);
  ProblemQuestion impossible = question_;
  impossible.written = "impossible";
  impossible.config.required_density = -1;
  EXPECT_TRUE(absl::IsInvalidArgument(prepared_.Of(impossible, nullptr, serial_, {}).status()));
  std::stop_source stop;
  stop.request_stop();
  ProblemQuestion other = question_;
  other.view = View(4);
  EXPECT_TRUE(absl::IsCancelled(
      prepared_.Of(other, nullptr, serial_, parallel::Cancellation(stop.get_token())).status()));
  EXPECT_EQ(Of(question_), first);
}

}  // namespace
}  // namespace vantage::session
