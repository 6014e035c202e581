#include "core/fleet/joint_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/fleet/fleet_request.h"
#include "core/fleet/guarantee.h"
#include "core/fleet/joint_plan_estimate.h"
#include "core/fleet/member_routes.h"
#include "core/fleet/pending_surface.h"
#include "core/fleet/remaining_gain.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/planning/problem/planning_problem.h"
#include "core/registration/bound/prediction.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::fleet {
namespace {

using ::testing::HasSubstr;

class JointPlanTest : public ::testing::Test {
 protected:
  JointPlanTest() {
    config_.viewcell_size = 0.4;
    config_.max_viewpoint_height = 1.7;
    config_.candidates = 5;
  }

  // Surface that the station sees has the density that a scan from there gives it.
  static test_support::ClosedFormScene Room(uint64_t seed) {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(seed);
    scene.density = [](const Eigen::Vector3d& p) {
      return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }

  JointPlan Make(const model::PlanningView& model, const FleetRequest& request,
                 const parallel::Budget& budget = parallel::Budget::Unlimited()) {
    return Make(model, request, budget, serial_);
  }
  JointPlan Make(const model::PlanningView& model, const FleetRequest& request,
                 const parallel::Budget& budget, parallel::Parallel& parallel) {
    auto plan =
        MakeJointPlan(model, request, config_, budget, parallel, [](const planning::Plan&) {});
    EXPECT_TRUE(plan.ok()) << plan.status();
    return plan.ok() ? *std::move(plan) : JointPlan{};
  }

  static FleetRequest RequestFor(size_t count) {
    FleetRequest request;
    request.scanners.resize(count);
    return request;
  }

  planning::PlanningConfig config_;
  parallel::Serial serial_;
};

// The gain of every view on every cell, and the joint gains of pairs.
class Exhaustive {
 public:
  Exhaustive(const model::PlanningView& model, const planning::PlanningConfig& config)
      : problem_(std::make_shared<model::PlanningView>(model), config) {
    for (const Eigen::Vector3d& view : problem_.views) {
      gains_.emplace_back(problem_.scoring->cells().size());
      problem_.scoring->scorer().ScoreCells(view, problem_.scoring->cells(),
                                            parallel::Budget::Unlimited(), gains_.back());
    }
  }
  size_t size() const { return gains_.size(); }
  const std::vector<Eigen::Vector3d>& views() const { return problem_.views; }
  double Together(std::initializer_list<size_t> which) const {
    double sum = 0;
    for (size_t i = 0; i < gains_.front().size(); ++i) {
      float best = 0;
      for (const size_t v : which) best = std::max(best, gains_[v][i]);
      sum += static_cast<double>(best);
    }
    return sum;
  }
  double BestPair() const {
    double best = 0;
    for (size_t a = 0; a < size(); ++a) {
      for (size_t b = a + 1; b < size(); ++b) best = std::max(best, Together({a, b}));
    }
    return best;
  }
  size_t IndexOf(const Eigen::Vector3d& position) const {
    for (size_t i = 0; i < size(); ++i) {
      if ((problem_.views[i] - position).norm() < 1e-6) return i;
    }
    return size();
  }

 private:
  test_support::PlanningProblem problem_;
  std::vector<std::vector<float>> gains_;
};

TEST_F(JointPlanTest, GreedyIsNearlyTheBestPairInEveryCase) {
  for (const uint64_t seed : {1u, 2u, 3u, 4u}) {
    SCOPED_TRACE(seed);
    const model::PlanningView model = test_support::BuildView(Room(seed));
    const Exhaustive all(model, config_);
    ASSERT_GT(all.size(), 30u);
    const JointPlan joint = Make(model, RequestFor(2));
    ASSERT_EQ(joint.plan.views.size(), 2u) << joint.plan.message;
    const size_t a = all.IndexOf(joint.plan.views[0].position);
    const size_t b = all.IndexOf(joint.plan.views[1].position);
    ASSERT_LT(std::max(a, b), all.size());
    const double together = all.Together({a, b});
    EXPECT_NEAR(joint.score, together, 1e-4 * together);
    EXPECT_NEAR(joint.plan.views[1].score, together - all.Together({a}), 1e-4 * together);
    EXPECT_GE(together, 0.95 * all.BestPair());
    // Each choice was the best there was.
    for (size_t v = 0; v < all.size(); ++v) {
      EXPECT_LE(all.Together({v}), all.Together({a}) * (1 + 1e-5));
      // Tripods need room.
      const double apart = (all.views()[v] - all.views()[a]).head<2>().norm();
      if (apart < 2 * sensor::ScannerModel().clearance) continue;
      EXPECT_LE(all.Together({a, v}), together * (1 + 1e-5));
    }
    EXPECT_EQ(joint.plan.optimality_gap, 0);
    ASSERT_TRUE(joint.guarantee.has_value()) << joint.guarantee_reason;
    EXPECT_NEAR(*joint.guarantee, 0.75, 1e-9);
  }
}

TEST_F(JointPlanTest, ASingleScannersPlanIsThePlan) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  const JointPlan joint = Make(model, RequestFor(1));
  const auto plan =
      planning::MakePlan(model, sensor::ScannerModel(), config_, parallel::Budget::Unlimited(),
                         serial_, [](const planning::Plan&) {});
  ASSERT_TRUE(plan.ok());
  ASSERT_EQ(joint.plan.views.size(), plan->views.size());
  for (size_t k = 0; k < plan->views.size(); ++k) {
    EXPECT_EQ(joint.plan.views[k].position, plan->views[k].position);
    EXPECT_NEAR(joint.plan.views[k].score, plan->views[k].score, 1e-4 * plan->views[k].score);
    EXPECT_EQ(joint.plan.views[k].verdict.error_bound, plan->views[k].verdict.error_bound);
    EXPECT_EQ(joint.plan.views[k].region.viewcell_count, plan->views[k].region.viewcell_count);
    ASSERT_TRUE(joint.plan.views[k].travel.has_value());
    EXPECT_TRUE(joint.journeys[k].unreachable.empty());
    EXPECT_NEAR(*joint.journeys[k].minutes, (*joint.plan.views[k].travel + 180) / 60, 1e-3);
    // A straighter way than along the grid, but none that is shorter than the straight line.
    EXPECT_LE(*joint.plan.views[k].travel, *plan->views[k].travel + 1e-3);
  }
  EXPECT_EQ(joint.plan.optimality_gap, plan->optimality_gap);
  EXPECT_EQ(joint.plan.score_map.size(), plan->score_map.size());
  ASSERT_EQ(joint.assignments.size(), 1u);
  EXPECT_EQ(joint.assignments[0].view, 0u);
  EXPECT_NEAR(joint.guarantee.value_or(0), 1, 1e-9);
}

// With an accuracy that two thirds of the views miss, many of them by little.
TEST_F(JointPlanTest, ADoubtfulViewDoesNotStandForThoseAroundIt) {
  config_.viewcell_size = 0.3;
  int better = 0;
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const auto model = std::make_shared<model::PlanningView>(
        test_support::BuildView(test_support::FurnishedRoom(seed)));
    config_.candidates = 40;
    config_.registration.required_accuracy = 0.5;
    std::vector<double> bounds;
    for (const planning::RankedView& view : Make(*model, RequestFor(1)).plan.views) {
      bounds.push_back(view.verdict.judged_bound);
    }
    ASSERT_GT(bounds.size(), 6u);
    std::sort(bounds.begin(), bounds.end());
    config_.registration.required_accuracy = registration::kBoundMargin * bounds[bounds.size() / 3];
    config_.candidates = 5;

    const auto plan =
        planning::MakePlan(*model, sensor::ScannerModel(), config_, parallel::Budget::Unlimited(),
                           serial_, [](const planning::Plan&) {});
    ASSERT_TRUE(plan.ok());
    const JointPlan joint = Make(*model, RequestFor(1));
    ASSERT_FALSE(plan->views.empty());
    ASSERT_FALSE(joint.plan.views.empty());
    EXPECT_EQ(joint.plan.views[0].position, plan->views[0].position);
    for (const planning::RankedView& view : joint.plan.views)
      EXPECT_TRUE(view.verdict.registered());
    // Somebody stands beside one that was refused.
    for (const planning::RankedView& refused : joint.plan.refused) {
      const double apart = (refused.position - joint.plan.views[0].position).norm();
      better += apart < config_.candidate_separation ? 1 : 0;
    }
    const JointPlan two = Make(*model, RequestFor(2));
    ASSERT_FALSE(two.plan.views.empty());
    EXPECT_EQ(two.plan.views[0].position, plan->views[0].position);
  }
  EXPECT_GT(better, 0);  // or nothing was tested
}

TEST_F(JointPlanTest, ClaimedViewsCountAsScanned) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  const JointPlan two = Make(model, RequestFor(2));
  ASSERT_EQ(two.plan.views.size(), 2u);
  FleetRequest request = RequestFor(1);
  request.pledged = {{two.plan.views[0].position, sensor::ScannerModel()}};
  const JointPlan around = Make(model, request);
  ASSERT_FALSE(around.plan.views.empty());
  EXPECT_EQ(around.plan.views[0].position, two.plan.views[1].position);
  EXPECT_NEAR(around.plan.views[0].score, two.plan.views[1].score, 1e-4 * two.plan.views[1].score);
  EXPECT_LT(around.plan.views[0].score, two.plan.views[0].score);
  // A finer scanner's claim leaves less, never more.
  sensor::ScannerModel coarse;
  coarse.azimuth_step = coarse.elevation_step = sensor::Radians(1);
  request.pledged[0].model = coarse;
  const JointPlan beside = Make(model, request);
  EXPECT_GT(beside.plan.views[0].score, around.plan.views[0].score);
}

TEST_F(JointPlanTest, ScannersThatDifferAreEachSentWhereTheyGainMost) {
  // The three best views lie apart, so that there is a guarantee.
  const model::PlanningView model = test_support::BuildView(Room(5));
  FleetRequest request = RequestFor(3);
  request.scanners[1].model.azimuth_step = sensor::Radians(0.5);
  request.scanners[1].model.range_max = 3;
  const JointPlan joint = Make(model, request);
  ASSERT_EQ(joint.plan.views.size(), 3u) << joint.plan.message;
  std::set<size_t> scanners;
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) {
    ASSERT_EQ(joint.assignments[k].view, k);
    scanners.insert(joint.assignments[k].scanner);
    sum += joint.plan.views[k].score;
    if (k > 0) {
      EXPECT_LE(joint.plan.views[k].score, joint.plan.views[k - 1].score * (1 + 1e-5));
    }
  }
  EXPECT_EQ(scanners.size(), 3u);
  EXPECT_NEAR(joint.score, sum, 1e-9 * sum);
  EXPECT_NEAR(joint.guarantee.value_or(0), 0.5, 1e-9) << joint.guarantee_reason;
}

TEST_F(JointPlanTest, WhoCannotGetAnywhereIsToldWhy) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  FleetRequest request = RequestFor(3);
  request.scanners[1].reach = {
      planning::Region(Eigen::Vector3d(50, 50, 0), Eigen::Vector3d(60, 60, 3))};
  request.scanners[2].at = Eigen::Vector3d(-20, 0, 1.5);
  const JointPlan joint = Make(model, request);
  ASSERT_EQ(joint.plan.views.size(), 1u);
  ASSERT_EQ(joint.assignments.size(), 3u);
  EXPECT_EQ(joint.assignments[0].scanner, 0u);
  EXPECT_FALSE(joint.assignments[1].view.has_value());
  EXPECT_THAT(joint.assignments[1].reason, HasSubstr("reach"));
  EXPECT_THAT(joint.assignments[2].reason, HasSubstr("outside of the model"));
}

TEST_F(JointPlanTest, ReachConfinesTheViews) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  FleetRequest confined = RequestFor(1);
  confined.scanners[0].reach = {
      planning::Region(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, 2.5, 2.7))};
  const JointPlan inside = Make(model, confined);
  ASSERT_FALSE(inside.plan.views.empty());
  for (const planning::RankedView& view : inside.plan.views) {
    EXPECT_TRUE(confined.scanners[0].reach[0].contains(view.position));
  }
  // Without it the best view is elsewhere.
  const JointPlan anywhere = Make(model, RequestFor(1));
  ASSERT_FALSE(anywhere.plan.views.empty());
  EXPECT_FALSE(confined.scanners[0].reach[0].contains(anywhere.plan.views[0].position));
}

TEST_F(JointPlanTest, NobodyWhoCanGoAnywhereIsNoFeasibleView) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  FleetRequest nobody = RequestFor(1);
  nobody.scanners[0].at = Eigen::Vector3d(-20, 0, 1.5);
  const JointPlan none = Make(model, nobody);
  EXPECT_EQ(none.plan.outcome, planning::PlanOutcome::kNoFeasibleView);
  EXPECT_THAT(none.plan.message, HasSubstr("outside of the model"));
  EXPECT_FALSE(none.guarantee.has_value());
}

TEST_F(JointPlanTest, WhoseScansWouldNotRegisterIsToldSo) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  config_.registration.required_accuracy = 0.05;
  config_.candidate_separation = 10;  // the first refusal stands for all
  FleetRequest request = RequestFor(2);
  // Sees nothing but the ceiling.
  request.scanners[1].model.elevation_min = sensor::Radians(60);
  request.scanners[1].model.elevation_max = sensor::Radians(80);
  const JointPlan joint = Make(model, request);
  ASSERT_EQ(joint.plan.views.size(), 1u) << joint.plan.message;
  EXPECT_EQ(joint.assignments[0].scanner, 0u);
  EXPECT_FALSE(joint.assignments[1].view.has_value());
  EXPECT_THAT(joint.assignments[1].reason, HasSubstr("registers"));
}

TEST_F(JointPlanTest, WhoseChecksEndEarlyIsPromisedNothing) {
  const model::PlanningView model = test_support::BuildView(Room(2));
  config_.registration.required_accuracy = 0.05;
  config_.max_checked = config_.candidates;
  config_.candidate_separation = 0;
  FleetRequest request = RequestFor(2);
  for (FleetMember& scanner : request.scanners) {
    scanner.model.elevation_min = sensor::Radians(60);
    scanner.model.elevation_max = sensor::Radians(80);
  }
  const JointPlan none = Make(model, request);
  EXPECT_TRUE(none.plan.views.empty());
  EXPECT_FALSE(none.guarantee.has_value());
  EXPECT_THAT(none.assignments[1].reason, HasSubstr("checked"));
}

TEST_F(JointPlanTest, ScorePerMinuteIsTheBestRatioThereIs) {
  const model::PlanningView model = test_support::BuildView(Room(5));
  FleetRequest request = RequestFor(1);
  request.ranking = FleetRanking::kScorePerMinute;
  request.scanners[0].speed = 0.02;  // a slow scanner
  request.scanners[0].scan_seconds = 30;
  const JointPlan joint = Make(model, request);
  ASSERT_FALSE(joint.plan.views.empty());
  const Exhaustive all(model, config_);
  const visibility::OpaqueGrid grid(model);
  const planning::FeasibleViews feasible =
      planning::FeasibleViews::Find(model, grid, sensor::ScannerModel(), config_, serial_).value();
  const MemberRoutes routes(request.scanners[0], model, feasible, true,
                            parallel::Budget::Unlimited());
  double best = 0;
  for (size_t v = 0; v < all.size(); ++v) {
    const auto length = routes.Length(all.views()[v]);
    if (length.has_value()) {
      best = std::max(best, all.Together({v}) / ((*length / 0.02 + 30) / 60));
    }
  }
  EXPECT_NEAR(joint.journeys[0].per_minute.value_or(0), best, 1e-3 * best);
  for (size_t k = 1; k < joint.journeys.size(); ++k) {
    EXPECT_LE(*joint.journeys[k].per_minute, *joint.journeys[k - 1].per_minute * (1 + 1e-5));
  }
  // The slower one walks, the nearer is the view.
  const JointPlan by_gain = Make(model, RequestFor(1));
  EXPECT_LE(*joint.journeys[0].length, *by_gain.journeys[0].length);
  EXPECT_GE(by_gain.plan.views[0].score, joint.plan.views[0].score);
  EXPECT_FALSE(joint.guarantee.has_value());
  EXPECT_THAT(joint.guarantee_reason, HasSubstr("per minute"));
}

TEST_F(JointPlanTest, AViewWaitsForTheScansThatItNeedsAndNoOthers) {
  test_support::PlanningProblem problem(
      std::make_shared<model::PlanningView>(test_support::BuildView(Room(2))), config_);
  const planning::BruteForceScorer& scorer = problem.scoring->scorer();
  PendingSurface expected(*problem.problem, problem.problem->overlap(), ExpectedRooms::kLeaveOut);
  const auto best = std::max_element(
      problem.views.begin(), problem.views.end(), [&](const auto& a, const auto& b) {
        return scorer.Score(a, problem.scoring->cells(), parallel::Budget::Unlimited()).score <
               scorer.Score(b, problem.scoring->cells(), parallel::Budget::Unlimited()).score;
      });
  uint64_t rays = 0;
  const RemainingGain nobody(problem.scoring->cells());
  RemainingGain after(problem.scoring->cells());
  // The second sees nothing that the first has not seen.
  ASSERT_TRUE(after.Take(*best, scorer, parallel::Budget::Unlimited(), rays));
  ASSERT_TRUE(after.Take(*best, scorer, parallel::Budget::Unlimited(), rays));
  registration::RegistrationConfig config = config_.registration;
  config.prior_sigma = 0.03;  // of a prediction 1.3 times the minimum is asked, or half way to 1
  const auto judge = [&](const Eigen::Vector3d& view, const RemainingGain& remaining) {
    return expected.Judge(view, remaining, config, parallel::Budget::Unlimited(), rays).value();
  };
  int waiting = 0;
  for (size_t v = 0; v < problem.views.size(); v += 3) {
    config.minimum_overlap = 1e-6;
    const double share = judge(problem.views[v], nobody).verdict.overlap_share;
    // More is wanted than there is.
    const double wanted = share + 0.01;
    config.minimum_overlap = std::max(wanted / 1.3, 2 * wanted - 1);
    EXPECT_FALSE(judge(problem.views[v], nobody).verdict.registered());
    const auto verdict = judge(problem.views[v], after);
    if (!verdict.verdict.registered()) {
      EXPECT_TRUE(verdict.waits_for.empty());
      continue;
    }
    ++waiting;
    EXPECT_EQ(verdict.waits_for, std::vector<size_t>{0});
    EXPECT_GT(verdict.verdict.overlap_share, share);
  }
  EXPECT_GT(waiting, 0);
}

// A job ends when too little is left for a view to gain; not while others' scans are on their way,
// unless all that is missing is too small to count.
TEST_F(JointPlanTest, ClaimedViewsKeepAJobOpen) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  FleetRequest request = RequestFor(1);
  EXPECT_FALSE(Make(model, request).plan.termination.suggested);
  config_.terminate_below = 1000;
  EXPECT_TRUE(Make(model, request).plan.termination.suggested);
  request.pledged = {{Eigen::Vector3d(1.5, 1.5, 1.5), sensor::ScannerModel()}};
  const planning::Termination open = Make(model, request).plan.termination;
  EXPECT_FALSE(open.suggested);
  EXPECT_THAT(open.reason, HasSubstr("not before the 1 claimed views"));
  config_.min_patch_area = 1000;
  EXPECT_TRUE(Make(model, request).plan.termination.suggested);
}

void ExpectSame(const JointPlan& a, const JointPlan& b) {
  EXPECT_EQ(a.plan.message, b.plan.message);
  EXPECT_EQ(a.plan.rays, b.plan.rays);
  EXPECT_EQ(a.score, b.score);
  EXPECT_EQ(a.guarantee, b.guarantee);
  EXPECT_EQ(a.guarantee_reason, b.guarantee_reason);
  ASSERT_EQ(a.plan.views.size(), b.plan.views.size());
  for (size_t k = 0; k < a.plan.views.size(); ++k) {
    EXPECT_EQ(a.plan.views[k].position, b.plan.views[k].position);
    EXPECT_EQ(a.plan.views[k].score, b.plan.views[k].score);
    EXPECT_EQ(a.assignments[k].scanner, b.assignments[k].scanner);
    EXPECT_EQ(a.journeys[k].minutes, b.journeys[k].minutes);
  }
}

TEST_F(JointPlanTest, SameOnAnyNumberOfThreadsUnderAWorkLimit) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  FleetRequest request = RequestFor(3);
  request.scanners[2].model.range_max = 5;
  for (const uint64_t limit : {40'000u, 400'000u}) {
    SCOPED_TRACE(limit);
    parallel::Budget budget;
    budget.work_limit = limit;
    const JointPlan one = Make(model, request, budget);
    for (const int threads : {2, 5}) {
      parallel::ThreadPool pool(threads);
      ExpectSame(one, Make(model, request, budget, pool));
    }
  }
}

// Of two scanners alike: 1 - (1 - a / 2)^2 of the best, a being how exact the choices were.
TEST_F(JointPlanTest, PromisesNothingBeforeEveryScannerIsDecidedOn) {
  for (const uint64_t seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    const model::PlanningView model = test_support::BuildView(Room(seed));
    const auto all = static_cast<double>(Make(model, RequestFor(2)).plan.rays);
    parallel::Budget budget;
    budget.work_limit = static_cast<uint64_t>(0.5 * all);
    const JointPlan early = Make(model, RequestFor(2), budget);
    EXPECT_GT(early.plan.optimality_gap, 0.01);
    EXPECT_FALSE(early.guarantee.has_value());
    EXPECT_THAT(early.guarantee_reason, HasSubstr("budget ended"));
    budget.work_limit = static_cast<uint64_t>(1.5 * all);
    const JointPlan late = Make(model, RequestFor(2), budget);
    ASSERT_TRUE(late.guarantee.has_value()) << late.guarantee_reason;
    const double a = 1 - late.plan.optimality_gap;
    EXPECT_NEAR(*late.guarantee, 1 - (1 - a / 2) * (1 - a / 2), 1e-9);
  }
}

TEST_F(JointPlanTest, WhatSamplesTellDoesWhenTheWorkLimitIsReached) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  const Exhaustive all(model, config_);
  FleetRequest request = RequestFor(1);
  request.ranking = FleetRanking::kScorePerMinute;
  request.scanners[0].speed = 0.02;
  const JointPlan unlimited = Make(model, request);
  int cut_short = 0;
  for (const uint64_t limit : {10'000u, 30'000u, 100'000u, 300'000u, 1'000'000u}) {
    SCOPED_TRACE(limit);
    parallel::Budget budget;
    budget.work_limit = limit;
    const JointPlan joint = Make(model, request, budget);
    ASSERT_FALSE(joint.plan.views.empty()) << joint.plan.message;
    cut_short += joint.plan.complete ? 0 : 1;
    const planning::RankedView& view = joint.plan.views[0];
    EXPECT_NEAR(view.score, all.Together({all.IndexOf(view.position)}), 1e-3 * view.score);
    // Each choice is the best but for the gap that is stated.
    const double best = *unlimited.journeys[0].per_minute;
    EXPECT_GE(*joint.journeys[0].per_minute, (1 - joint.plan.optimality_gap) * best * (1 - 1e-5));
    EXPECT_GE(*joint.journeys[0].per_minute, 0.5 * best);
  }
  EXPECT_GE(cut_short, 3);
  // Two scanners still get views.
  parallel::Budget budget;
  budget.work_limit = 200'000;
  EXPECT_EQ(Make(model, RequestFor(2), budget).plan.views.size(), 2u);
}

// A clock by which every look at it takes two milliseconds, as on a slow machine: what a plan
// does after its budget is then the same in each run.
parallel::Budget::Clock::time_point SlowClock() {
  static std::atomic<int64_t> looks{0};
  return parallel::Budget::Clock::time_point(std::chrono::milliseconds(2 * ++looks));
}

TEST_F(JointPlanTest, AnswersWithoutAnyTimeUnlessItIsCancelled) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  parallel::Budget none;
  none.now = &SlowClock;
  none.deadline = SlowClock();
  for (const size_t scanners : {1, 2, 3}) {
    const JointPlan joint = Make(model, RequestFor(scanners), none);
    EXPECT_EQ(joint.plan.outcome, planning::PlanOutcome::kViews) << joint.plan.message;
    ASSERT_EQ(joint.assignments.size(), scanners);
    for (const Assignment& assignment : joint.assignments) {
      EXPECT_TRUE(assignment.view.has_value()) << scanners << ": " << assignment.reason;
    }
  }
  std::stop_source stop;
  stop.request_stop();
  parallel::Budget budget = parallel::Budget::Unlimited();
  budget.cancelled = stop.get_token();
  EXPECT_EQ(Make(model, RequestFor(2), budget).plan.outcome, planning::PlanOutcome::kCancelled);
}

TEST_F(JointPlanTest, RefusesWhatIsImpossible) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  const auto code = [&](const FleetRequest& request) {
    return MakeJointPlan(model, request, config_, parallel::Budget::Unlimited(), serial_,
                         [](const planning::Plan&) {})
        .status()
        .code();
  };
  EXPECT_EQ(code(RequestFor(0)), absl::StatusCode::kInvalidArgument);
  FleetRequest slow = RequestFor(1);
  slow.scanners[0].speed = 0;
  EXPECT_EQ(code(slow), absl::StatusCode::kInvalidArgument);
  FleetRequest lost = RequestFor(1);
  lost.scanners[0].at = Eigen::Vector3d(NAN, 0, 0);
  EXPECT_EQ(code(lost), absl::StatusCode::kInvalidArgument);
  FleetRequest pledged = RequestFor(1);
  pledged.pledged = {{Eigen::Vector3d(0, INFINITY, 0), sensor::ScannerModel()}};
  EXPECT_EQ(code(pledged), absl::StatusCode::kInvalidArgument);
  config_.memory_limit = 1000;
  EXPECT_EQ(code(RequestFor(1)), absl::StatusCode::kResourceExhausted);
}

TEST_F(JointPlanTest, RefusesWhatTakesMoreMemoryThanAllowed) {
  const model::PlanningView model = test_support::BuildView(Room(3));
  const FleetRequest request = RequestFor(1);
  const auto problem =
      planning::PlanningProblem::Prepare({model, request.scanners[0].model, config_}, serial_)
          .value();
  // What is known before step A fits; the feasible views that it finds are too many.
  config_.memory_limit = planning::PlanningSize(model, config_)
                             .Bytes(static_cast<double>(problem->feasible().cells().size())) -
                         1;
  ASSERT_TRUE(CheckJointPlanSize(model, config_, 1).ok());
  const absl::Status status = MakeJointPlan(model, request, config_, parallel::Budget::Unlimited(),
                                            serial_, [](const planning::Plan&) {})
                                  .status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("memory_limit"));
}

TEST(GuaranteeTest, IsWhatTheTheoremsSay) {
  GreedyRecord record;
  record.scanners = 1;
  EXPECT_NEAR(GuaranteeOf(record).share.value_or(0), 1, 1e-12);
  record.scanners = 16;
  EXPECT_NEAR(GuaranteeOf(record).share.value_or(0), 1 - std::pow(15.0 / 16, 16), 1e-12);
  EXPECT_GT(*GuaranteeOf(record).share, 1 - std::exp(-1));
  record.exactness = 0.5;
  EXPECT_NEAR(GuaranteeOf(record).share.value_or(0), 1 - std::pow(15.5 / 16, 16), 1e-12);
  record.alike = false;
  EXPECT_NEAR(GuaranteeOf(record).share.value_or(0), 1.0 / 3, 1e-12);
  for (bool GreedyRecord::*none : {&GreedyRecord::by_minutes, &GreedyRecord::waits,
                                   &GreedyRecord::crowded, &GreedyRecord::cut_short}) {
    GreedyRecord without = record;
    without.*none = true;
    EXPECT_FALSE(GuaranteeOf(without).share.has_value());
    EXPECT_THAT(GuaranteeOf(without).reason, HasSubstr("none: "));
  }
}

}  // namespace
}  // namespace vantage::fleet
