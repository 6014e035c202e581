// Deadlines and cancellation by steps of work instead of time: every look at the clock is a step.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/hierarchy.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/openings/openings.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/scoring/patch_tree.h"
#include "core/planning/scoring/scoring.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/runs.h"

namespace vantage::planning {
namespace {

// The clock that budgets are given: a function without state of its own.
std::atomic<int64_t> steps{0};
std::atomic<int64_t> stop_at{0};
std::stop_source* stopper = nullptr;

parallel::Budget::Clock::time_point Step() {
  const int64_t step = ++steps;
  if (stopper != nullptr && step >= stop_at.load()) stopper->request_stop();
  return parallel::Budget::Clock::time_point(std::chrono::nanoseconds(step));
}

class PlannerBudgetTest : public ::testing::Test {
 protected:
  PlannerBudgetTest() : model_(test_support::BuildView(test_support::FurnishedRoom(3))) {
    config_.viewcell_size = 0.2;
    config_.registration.required_accuracy = 0.1;
    config_.registration.minimum_overlap = 0.01;
    steps = 0;
    stopper = nullptr;
  }
  Plan Make(
      const parallel::Budget& budget, parallel::Parallel& parallel,
      PlanProgress progress = [](const Plan&) {}) {
    return MakePlan(model_, scanner_, config_, budget, parallel, progress).value();
  }
  static parallel::Budget EndingAt(int64_t step) {
    parallel::Budget budget;
    budget.now = &Step;
    budget.deadline = parallel::Budget::Clock::time_point(std::chrono::nanoseconds(step));
    return budget;
  }

  model::PlanningView model_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

// How often a plan may look at the clock after its end: once in each round of the loop it is in.
// Such a round does nothing else.
constexpr int64_t kStepsToStop = 4000;
// Plans end at steps that are so many times as late from one to the next.
constexpr int64_t kNext = test_support::Runs(16) == 16 ? 2 : 64;

// From the first to nearly the last.
std::vector<int64_t> EndsWithin(int64_t whole) {
  std::vector<int64_t> ends;
  for (int64_t end = 1; end < whole; end *= kNext) ends.push_back(end);
  ends.push_back(whole - whole / 16);
  return ends;
}

// What is built before the first view is scored takes a second for a large storey: everything in it
// looks at the clock after a bounded amount of work.
TEST_F(PlannerBudgetTest, SetupLooksAtTheClockAsOftenAsItsWorkDemands) {
  const parallel::Budget budget = EndingAt(int64_t{1} << 60);
  int64_t before = 0;
  const auto looks = [&](auto&& build) {
    before = steps;
    build();
    return steps - before;
  };
  const auto bricks = static_cast<int64_t>(model_.bricks().size());
  const visibility::OpaqueGrid grid(model_);
  const model::VoxelIndex size = grid.box().max - grid.box().min;
  EXPECT_GE(looks([&] { (void)grid.Summed(serial_, budget); }), size.y() + size.z());
  EXPECT_GE(looks([&] { (void)FloorMap::Find(model_, std::nullopt, budget); }), bricks / 128 + 3);
  const FloorMap floor = FloorMap::Find(model_, std::nullopt).value();
  EXPECT_GE(looks([&] { (void)FindOpenings(model_, floor, budget); }),
            bricks / 128 + 2 * size.x() * size.y() / 4096);
  EXPECT_GE(
      looks([&] { (void)FeasibleViews::Find(model_, grid, scanner_, config_, serial_, budget); }),
      bricks / 128 + size.y() / 4 + size.z() / 4 + size.y());
  PatchSet patches;
  EXPECT_GE(looks([&] { patches = ExtractPatches(model_, config_, {}, budget).value(); }),
            bricks / 128 + 2);
  const auto cells = static_cast<int64_t>(patches.cells.size());
  ASSERT_GT(cells, 10'000);
  EXPECT_GE(looks([&] { patches = RankPatches(config_, patches, budget).value(); }),
            cells / 16384);  // patches are whole
  std::optional<visibility::OcclusionScene> scene;
  EXPECT_GE(
      looks([&] { scene = visibility::OcclusionScene::Create(grid, serial_, budget).value(); }),
      size.sum());
  std::unique_ptr<const Scoring> scoring;
  OrderedCells ordered;
  EXPECT_GE(looks([&] {
              ordered = Scoring::CellsOf(grid, patches, scanner_, config_, serial_, budget).value();
            }),
            cells / 8192);
  scoring = Scoring::Create(model_.voxel_size(), grid, *scene, std::move(ordered), scanner_,
                            config_, serial_, budget)
                .value();
  EXPECT_GE(looks([&] { (void)PatchTree::Create(scoring->cells(), serial_, budget); }),
            static_cast<int64_t>(scoring->cells().packets()));
  EXPECT_GE(
      looks([&] { (void)OverlapSurface::Create(model_, grid, *scene, scanner_, serial_, budget); }),
      2 * (bricks / 128));
}

TEST_F(PlannerBudgetTest, SetupThatIsCutShortSaysSo) {
  steps = 0;
  const auto whole =
      PlanningProblem::Prepare({model_, scanner_, config_}, serial_, EndingAt(int64_t{1} << 60))
          .value();
  const int64_t all = steps;
  std::set<std::string> stopped;
  for (int64_t end = 1; end < all; end += 1 + end / 2) {
    steps = 0;
    const auto cut = PlanningProblem::Prepare({model_, scanner_, config_}, serial_, EndingAt(end));
    EXPECT_EQ(cut.status().code(), absl::StatusCode::kCancelled) << "step " << end << " of " << all;
    stopped.emplace(cut.status().message());
  }
  EXPECT_THAT(stopped, ::testing::IsSupersetOf({"feasible views", "evaluate views"}));
  const auto hierarchy = [&](const parallel::Budget& budget) {
    steps = 0;
    return HierarchicalScorer::Create(whole->scoring().scorer(), whole->grid(),
                                      whole->scoring().cells(), whole->feasible().cells(),
                                      whole->feasible().cell_size(), {}, budget, serial_);
  };
  ASSERT_TRUE(hierarchy(EndingAt(int64_t{1} << 60)).ok());
  const int64_t last = steps;
  // In the tables, and where the blocks are found.
  for (const int64_t end : {int64_t{5}, last - 1}) {
    EXPECT_EQ(hierarchy(EndingAt(end)).status().code(), absl::StatusCode::kCancelled);
  }
}

// With an answer, too: where no view was evaluated when the budget ended, a few are.
TEST_F(PlannerBudgetTest, EndsSoonAfterItsDeadlineWhereverThatFalls) {
  (void)Make(EndingAt(int64_t{1} << 60), serial_);
  const int64_t whole = steps;
  for (const int64_t end : EndsWithin(whole)) {
    steps = 0;
    const Plan plan = Make(EndingAt(end), serial_);
    EXPECT_LE(steps.load(), end + kStepsToStop)
        << "deadline at step " << end << " of " << whole << ": " << plan.message;
    EXPECT_FALSE(plan.complete && end < whole / 4);
    EXPECT_EQ(plan.outcome, PlanOutcome::kViews) << "deadline at step " << end << " of " << whole;
    ASSERT_FALSE(plan.views.empty());
    EXPECT_TRUE(plan.views[0].checked);
    EXPECT_TRUE(plan.views[0].verdict.registered());
    EXPECT_GE(plan.views[0].upper, plan.views[0].lower);
  }
}

// Bounds hold, and the first view is one to go to, from the first that is shown on.
TEST_F(PlannerBudgetTest, TheFirstViewOfAllThatIsShownRegisters) {
  const Plan best = Make(parallel::Budget::Unlimited(), serial_);
  ASSERT_FALSE(best.views.empty());
  int shown = 0;
  const auto progress = [&](const Plan& so_far) {
    ++shown;
    ASSERT_FALSE(so_far.views.empty());
    const RankedView& first = so_far.views.front();
    EXPECT_TRUE(first.checked);
    EXPECT_TRUE(first.verdict.registered());
    EXPECT_FALSE(first.location.description.empty());
    EXPECT_LE(first.lower, best.views[0].score * (1 + 1e-9));
    for (size_t k = 1; k < so_far.views.size(); ++k) {
      EXPECT_FALSE(so_far.views[k].checked);
      EXPECT_GE((so_far.views[k].position - first.position).norm(), config_.candidate_separation);
    }
  };
  const Plan last = Make(parallel::Budget::Unlimited(), serial_, progress);
  EXPECT_GT(shown, 2);
  EXPECT_EQ(last.rays, best.rays);
  EXPECT_EQ(last.views[0].position, best.views[0].position);
}

// However small the share is that the evaluation leaves, and however far it overran its own: a
// ranking of which nothing was checked is worth little.
TEST_F(PlannerBudgetTest, ChecksTheFirstCandidateWheneverAnyViewWasEvaluated) {
  const auto problem =
      PlanningProblem::Prepare({model_, scanner_, config_}, serial_, parallel::Budget::Unlimited())
          .value();
  const auto make = [&](const parallel::Budget& budget, bool& evaluated) {
    return MakePlan(*problem, budget, serial_,
                    [&](const Plan& so_far) { evaluated = evaluated || !so_far.views.empty(); });
  };
  bool evaluated = false;
  steps = 0;
  (void)make(EndingAt(int64_t{1} << 60), evaluated);
  const int64_t whole = steps;
  int times = 0;
  for (int64_t end = 1; end < whole; end += 1 + end / 4) {
    steps = 0;
    evaluated = false;
    const Plan plan = make(EndingAt(end), evaluated);
    EXPECT_LE(steps.load(), end + kStepsToStop);
    if (!evaluated) continue;
    ++times;
    EXPECT_FALSE(plan.views.empty() && plan.refused.empty())
        << "deadline at step " << end << " of " << whole << ": " << plan.message;
    for (const RankedView& view : plan.views) EXPECT_TRUE(view.checked);
  }
  EXPECT_GT(times, 3);
}

TEST_F(PlannerBudgetTest, EndsSoonAfterItIsCancelledWhereverThatFalls) {
  (void)Make(EndingAt(int64_t{1} << 60), serial_);
  const int64_t whole = steps;
  parallel::ThreadPool pool(2);
  for (int64_t end = 1; end < whole; end *= kNext) {
    std::stop_source source;
    steps = 0;
    stop_at = end;
    stopper = &source;
    parallel::Budget budget = EndingAt(int64_t{1} << 60);
    budget.cancelled = source.get_token();
    const Plan plan = Make(budget, pool);
    stopper = nullptr;
    EXPECT_EQ(plan.outcome, PlanOutcome::kCancelled) << "at step " << end << " of " << whole;
    EXPECT_LE(steps.load(), end + kStepsToStop);
  }
}

TEST_F(PlannerBudgetTest, InAHurryAnswersWithWhatItHas) {
  (void)Make(EndingAt(int64_t{1} << 60), serial_);
  const int64_t whole = steps;
  parallel::ThreadPool pool(2);
  bool views = false;
  for (int64_t end = 1; end < whole; end *= kNext) {
    std::stop_source source;
    steps = 0;
    stop_at = end;
    stopper = &source;
    parallel::Budget budget = EndingAt(int64_t{1} << 60);
    budget.hurried = source.get_token();
    std::vector<Plan> shown;
    const Plan plan = Make(budget, pool, [&](const Plan& so_far) { shown.push_back(so_far); });
    stopper = nullptr;
    EXPECT_NE(plan.outcome, PlanOutcome::kCancelled) << "at step " << end << " of " << whole;
    if (shown.empty() || shown.back().views.empty()) continue;
    // What was shown to gain is not taken back.
    EXPECT_EQ(plan.outcome, PlanOutcome::kViews) << plan.message;
    EXPECT_FALSE(plan.views.empty());
    views = true;
  }
  EXPECT_TRUE(views);
}

}  // namespace
}  // namespace vantage::planning
