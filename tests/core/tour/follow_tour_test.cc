#include "core/tour/follow_tour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/fleet/look_ahead.h"
#include "core/planning/ranking/view_report.h"
#include "tests/core/tour/flat_tour.h"

namespace vantage::tour {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr uint64_t kWork = 40'000'000;  // rays

class FollowTourTest : public testing::Test {
 protected:
  FollowTourTest() {
    for (const TourStop& stop : flat_.Make().stops) stations_.push_back(stop.position);
  }
  planning::Plan Plan() {
    parallel::Budget budget;
    budget.work_limit = kWork;
    return fleet::MakePlanLookingAhead(flat_.problem(), budget, flat_.pool(),
                                       [](const planning::Plan&) {});
  }
  planning::Plan Follow(planning::Plan plan, std::vector<Eigen::Vector3d> stations,
                        const parallel::Budget& budget = {}) {
    FollowTour(flat_.problem(), stations, budget, flat_.pool(), plan);
    return plan;
  }
  static std::vector<Eigen::Vector3d> Places(const planning::Plan& plan) {
    std::vector<Eigen::Vector3d> places;
    for (const planning::RankedView& view : plan.views) places.push_back(view.position);
    return places;
  }

  FlatTour flat_{3};
  std::vector<Eigen::Vector3d> stations_;
};

TEST_F(FollowTourTest, TheNextStopComesFirst) {
  const planning::Plan greedy = Plan();
  ASSERT_GT(greedy.views.size(), 1U);
  size_t others = 0;
  for (const Eigen::Vector3d& station : stations_) {
    const planning::Plan plan = Follow(greedy, {station});
    ASSERT_TRUE(plan.followed_tour.has_value());
    if (!plan.followed_tour->station.has_value()) continue;
    EXPECT_EQ(*plan.followed_tour->station, 0U);
    const planning::RankedView& first = plan.views.front();
    EXPECT_LE((first.position - station).norm(), kSamePlace);
    EXPECT_TRUE(first.verdict.registered());
    EXPECT_GE(first.gain_without_hidden.value(), flat_.config().terminate_below);
    // No worse than the place itself, by an evaluation that knows nothing of tours.
    EXPECT_GE(first.score, flat_.Evaluate(station).view.score * (1 - 1e-9));
    EXPECT_NEAR(first.score, flat_.Evaluate(first.position).view.score, 1e-6 * first.score);
    ASSERT_TRUE(plan.followed_tour->otherwise.has_value());
    const size_t otherwise = *plan.followed_tour->otherwise;
    EXPECT_EQ(plan.views[otherwise].position, greedy.views[0].position);
    if (otherwise == 0) continue;
    ++others;
    EXPECT_THAT(plan.followed_tour->message, HasSubstr("stop 1 of the tour stands first"));
    EXPECT_THAT(plan.followed_tour->message, HasSubstr("without the tour it would be rank 2"));
    // The others are in their order, and apart from it.
    for (size_t k = 2; k < plan.views.size(); ++k) {
      EXPECT_GE((plan.views[k].position - first.position).norm(),
                flat_.config().candidate_separation);
      EXPECT_LE(plan.views[k].score, plan.views[1].score);
    }
    EXPECT_LE(plan.views.size(), static_cast<size_t>(flat_.config().candidates));
  }
  EXPECT_GT(others, 0U);
}

TEST_F(FollowTourTest, OfThoseLeftTheOneThatBringsMost) {
  ASSERT_GT(stations_.size(), 2U);
  flat_.ScanFrom(stations_[0]);
  const planning::Plan greedy = Plan();
  const planning::Plan plan = Follow(greedy, stations_);
  ASSERT_TRUE(plan.followed_tour.has_value());
  ASSERT_TRUE(plan.followed_tour->station.has_value()) << plan.followed_tour->message;
  const size_t chosen = *plan.followed_tour->station;
  EXPECT_GT(chosen, 0U);
  EXPECT_THAT(plan.followed_tour->message, HasSubstr("of the others 1 was made"));
  EXPECT_LE((plan.views[0].position - stations_[chosen]).norm(), kSamePlace);
  for (size_t k = 1; k < stations_.size(); ++k) {
    const planning::Plan other = Follow(greedy, {stations_[k]});
    if (!other.followed_tour->station.has_value()) continue;
    // Stations are compared by a map of estimates, then scored.
    EXPECT_LE(other.views[0].score, 1.1 * plan.views[0].score) << k;
  }
}

TEST_F(FollowTourTest, WhereNoStopIsAcceptableThePlanStays) {
  const planning::Plan greedy = Plan();
  flat_.config().terminate_below = 1000;
  flat_.Prepare();
  planning::Plan plan = Follow(greedy, {stations_[0], {100, 100, 1.5}});
  ASSERT_TRUE(plan.followed_tour.has_value());
  EXPECT_FALSE(plan.followed_tour->station.has_value());
  EXPECT_FALSE(plan.followed_tour->otherwise.has_value());
  EXPECT_EQ(
      plan.followed_tour->message,
      "the tour is not followed: of its 2 stops 1 cannot be stood at, 1 brings less than 1e+03 "
      "m\u00b2 by now");
  EXPECT_EQ(Places(plan), Places(greedy));
  // Nobody waits for what was cancelled.
  std::stop_source stop;
  stop.request_stop();
  parallel::Budget cancelled;
  cancelled.cancelled = stop.get_token();
  plan = Follow(greedy, stations_, cancelled);
  EXPECT_THAT(plan.followed_tour->message, HasSubstr("not looked at for want of time"));
  EXPECT_EQ(Places(plan), Places(greedy));
  // What is merely late is followed.
  flat_.config().terminate_below = 0.5;
  flat_.Prepare();
  plan = Follow(greedy, stations_, parallel::Budget::Seconds(0));
  EXPECT_TRUE(plan.followed_tour->station.has_value()) << plan.followed_tour->message;
  EXPECT_TRUE(plan.views.front().verdict.registered());
  // Who follows none hears nothing of it.
  EXPECT_FALSE(Follow(greedy, {}).followed_tour.has_value());
}

// Where the plan suggests to stop, nobody is sent on.
TEST_F(FollowTourTest, APlanThatSuggestsToStopStays) {
  planning::Plan greedy = Plan();
  greedy.termination.suggested = true;
  const planning::Plan plan = Follow(greedy, stations_);
  EXPECT_FALSE(plan.followed_tour->station.has_value());
  EXPECT_THAT(plan.followed_tour->message, HasSubstr("another scan is not worth it"));
  EXPECT_EQ(Places(plan), Places(greedy));
}

// What the map did not come to is not taken for what brings nothing.
TEST_F(FollowTourTest, AStationThatWasNotScoredIsLookedAtLate) {
  planning::Plan greedy = Plan();
  const Eigen::Vector3d station = stations_[0];
  std::erase_if(greedy.score_map, [&](const planning::ScoredCell& cell) {
    return (cell.centre.cast<double>() - station).norm() < 2 * kSamePlace;
  });
  const planning::Plan plan = Follow(greedy, {station}, parallel::Budget::Seconds(0));
  EXPECT_THAT(plan.followed_tour->message, Not(HasSubstr("less than")));
}

// A view names no other to fall back on that is not in the plan.
TEST_F(FollowTourTest, FallbacksAreAmongTheViews) {
  std::vector<planning::RankedView> views(2);
  for (planning::RankedView& view : views) view.expected.emplace().fallback = 2;
  planning::ViewReport::NameFallback(views);
  for (const planning::RankedView& view : views) {
    EXPECT_FALSE(view.expected->fallback.has_value());
  }
}

TEST_F(FollowTourTest, WhatDoesNotRegisterIsPassedOver) {
  flat_.config().registration.required_accuracy = 1e-6;
  flat_.Prepare();
  const planning::Plan greedy = Plan();
  ASSERT_TRUE(greedy.views.empty());
  const planning::Plan plan = Follow(greedy, stations_);
  EXPECT_FALSE(plan.followed_tour->station.has_value());
  EXPECT_THAT(plan.followed_tour->message, HasSubstr("not register"));
  EXPECT_EQ(plan.outcome, greedy.outcome);
}

// Of stations that a scan would register at only in doubt none is gone to, however much it brings;
// the next that registers is.
TEST_F(FollowTourTest, ADoubtfulStationIsPassedOverForOneThatRegisters) {
  std::vector<double> bounds;
  for (const Eigen::Vector3d& station : stations_) {
    const planning::ViewEvaluation at = flat_.Evaluate(station);
    if (at.feasible && at.view.verdict.registered()) bounds.push_back(at.view.verdict.judged_bound);
  }
  ASSERT_GT(bounds.size(), 3U);
  std::sort(bounds.begin(), bounds.end());
  flat_.config().registration.required_accuracy = bounds[bounds.size() * 3 / 4];
  flat_.Prepare();
  const planning::Plan greedy = Plan();
  size_t doubtful = 0;
  size_t registered = 0;
  std::string told;
  std::vector<Eigen::Vector3d> refused;
  for (const Eigen::Vector3d& station : stations_) {
    const registration::RegistrationVerdict at = flat_.Evaluate(station).view.verdict;
    const planning::Plan plan = Follow(greedy, {station});
    told += plan.followed_tour->message + "\n";
    if (plan.followed_tour->station.has_value()) {
      ++registered;
      EXPECT_TRUE(plan.views.front().verdict.registered());
      continue;
    }
    if (plan.followed_tour->message.find("not register") == std::string::npos) continue;
    EXPECT_EQ(Places(plan), Places(greedy));
    refused.push_back(station);
    doubtful += at.outcome == registration::RegistrationOutcome::kDoubtful ? 1 : 0;
  }
  ASSERT_GT(doubtful, 0U) << told;
  ASSERT_GT(registered, 0U) << told;
  const planning::Plan none = Follow(greedy, refused);
  EXPECT_FALSE(none.followed_tour->station.has_value());
  const planning::Plan plan = Follow(greedy, stations_);
  ASSERT_TRUE(plan.followed_tour->station.has_value()) << plan.followed_tour->message;
  EXPECT_TRUE(plan.views.front().verdict.registered());
}

// A sector faces somewhere: to where it brings most and registers.
TEST_F(FollowTourTest, AScannerThatSeesASectorIsToldWhereToFace) {
  flat_.UseSector(sensor::Radians(100));
  const planning::Plan greedy = Plan();
  size_t followed = 0;
  for (const Eigen::Vector3d& station : stations_) {
    const planning::Plan plan = Follow(greedy, {station});
    if (!plan.followed_tour->station.has_value()) continue;
    ++followed;
    const planning::RankedView& first = plan.views.front();
    ASSERT_TRUE(first.heading.has_value());
    EXPECT_LE((first.position - station).norm(), kSamePlace);
    const planning::ViewEvaluation there = flat_.Evaluate(first.position, first.heading);
    EXPECT_TRUE(there.view.verdict.registered());
    EXPECT_NEAR(first.score, there.view.score, 1e-6 * first.score);
    // Facing away it would bring less, or not register.
    const planning::RankedView away = flat_.Evaluate(first.position, *first.heading + M_PI).view;
    EXPECT_TRUE(away.score < first.score || !away.verdict.registered())
        << away.score << " instead of " << first.score;
  }
  EXPECT_GT(followed, 0U);
}

// The stations of a tour are places: who follows it with another setting is told what that brings.
TEST_F(FollowTourTest, WithAnotherSettingThanTheToursByWhatThatOneBrings) {
  sensor::ScannerModel coarse = flat_.scanner();
  coarse.azimuth_step = coarse.elevation_step = sensor::Radians(0.8);
  coarse.range_max = 0.5 * coarse.range_max;
  const planning::Plan fine = Follow(Plan(), stations_);
  flat_.UseScanner(coarse);
  const planning::Plan plan = Follow(Plan(), stations_);
  ASSERT_TRUE(fine.followed_tour->station.has_value());
  ASSERT_TRUE(plan.followed_tour->station.has_value()) << plan.followed_tour->message;
  const planning::RankedView& first = plan.views.front();
  EXPECT_NEAR(first.score, flat_.Evaluate(first.position).view.score, 1e-6 * first.score);
  EXPECT_LT(first.score, 0.9 * fine.views.front().score);
}

// Its rays are the plan's: what they cost counts, and where a work limit is spent before, nothing
// beyond what is done late.
TEST_F(FollowTourTest, ItsRaysAreWithinThePlansLimit) {
  const planning::Plan greedy = Plan();
  const planning::Plan whole = Follow(greedy, stations_);
  ASSERT_GT(whole.rays, greedy.rays);
  parallel::Budget spent;
  spent.work_limit = greedy.rays;
  const planning::Plan late = Follow(greedy, stations_, spent);
  EXPECT_LE(late.rays - greedy.rays, whole.rays - greedy.rays);
  // With all that it takes it is what it is without a limit.
  parallel::Budget enough;
  enough.work_limit = 2 * whole.rays;
  const planning::Plan same = Follow(greedy, stations_, enough);
  EXPECT_EQ(same.rays, whole.rays);
  EXPECT_EQ(Places(same), Places(whole));
  // One that does not follow a tour costs none.
  EXPECT_EQ(Follow(greedy, {{100, 100, 1.5}}).rays, greedy.rays);
}

TEST_F(FollowTourTest, AViewWhereThereWasNone) {
  planning::Plan none = Plan();
  none.views.clear();
  none.outcome = planning::PlanOutcome::kNoRegistrableView;
  const planning::Plan plan = Follow(none, stations_);
  ASSERT_TRUE(plan.followed_tour->station.has_value());
  EXPECT_EQ(plan.outcome, planning::PlanOutcome::kViews);
  EXPECT_EQ(plan.views.size(), 1U);
  EXPECT_FALSE(plan.followed_tour->otherwise.has_value());
  EXPECT_THAT(plan.followed_tour->message, HasSubstr("without the tour there would be no view"));
}

TEST_F(FollowTourTest, TheSameOnAnyNumberOfThreads) {
  const planning::Plan greedy = Plan();
  const planning::Plan plan = Follow(greedy, stations_);
  planning::Plan alone = greedy;
  parallel::Serial serial;
  FollowTour(flat_.problem(), stations_, {}, serial, alone);
  EXPECT_EQ(Places(plan), Places(alone));
  EXPECT_EQ(plan.rays, alone.rays);
  EXPECT_GT(plan.rays, greedy.rays);
  EXPECT_EQ(plan.followed_tour->message, alone.followed_tour->message);
}

}  // namespace
}  // namespace vantage::tour
