// When to stop: by what is still missing and by what a view may still gain, at the limits.
#include "core/planning/ranking/termination.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>

namespace vantage::planning {
namespace {

using ::testing::HasSubstr;

// Patches of these areas, m2, and nothing else of them.
PatchSet PatchesOf(std::initializer_list<double> areas) {
  PatchSet set;
  for (const double area : areas) {
    Patch patch;
    patch.area = area;
    set.patches.push_back(patch);
    set.area += area;
  }
  return set;
}

// Views with at most so many samples each. What is estimated of them is half of that.
Evaluation ViewsWithUpper(std::initializer_list<double> upper) {
  Evaluation evaluation;
  for (const double most : upper) {
    ViewEstimate view;
    view.score = most / 2;
    view.upper = most;
    view.scored = true;
    evaluation.views.push_back(view);
  }
  return evaluation;
}

// The best view brings so many m2 to the required density, at least and at most.
GainBounds Gains(double lower, double upper) { return {lower, upper, 0}; }

class TerminationTest : public ::testing::Test {
 protected:
  TerminationTest() {
    config_.required_density = 1000;
    config_.terminate_below = 0.5;
    config_.min_patch_area = 0.02;
  }
  Termination Judge(const PatchSet& patches, std::optional<GainBounds> gains) const {
    return JudgeTermination(patches, ViewsWithUpper({5000}), config_, std::nullopt, gains);
  }
  PlanningConfig config_;
};

TEST_F(TerminationTest, IsSuggestedWhenNothingIsMissing) {
  const Termination end = JudgeTermination(PatchesOf({}), {}, config_, std::nullopt, std::nullopt);
  EXPECT_TRUE(end.suggested);
  EXPECT_THAT(end.reason, HasSubstr("required density of 1000"));
  EXPECT_EQ(end.largest_patch_area, 0);
  EXPECT_FALSE(end.best_upper.has_value());
  EXPECT_FALSE(end.best_gain_without_hidden.has_value());
}

// By the largest patch alone, however many there are and whatever a view would gain on them.
TEST_F(TerminationTest, IsSuggestedWhenEveryPatchIsBelowTheLeastArea) {
  const GainBounds much = Gains(5, 5);
  const Termination below = Judge(PatchesOf({0.0199, 0.0199, 0.0199, 0.0199}), much);
  EXPECT_TRUE(below.suggested);
  EXPECT_THAT(below.reason, HasSubstr("0.0199 m2, less than 0.0200 m2"));
  EXPECT_FALSE(Judge(PatchesOf({0.0199, 0.02}), much).suggested);
}

TEST_F(TerminationTest, TheLeastAreaIsTheConfigurations) {
  const PatchSet patches = PatchesOf({0.3, 0.7, 0.1});
  const GainBounds much = Gains(5, 5);
  EXPECT_FALSE(Judge(patches, much).suggested);
  config_.min_patch_area = 0.71;
  const Termination end = Judge(patches, much);
  EXPECT_TRUE(end.suggested);
  EXPECT_EQ(end.largest_patch_area, 0.7);
}

// By what the best view may gain, not by what is known of it.
TEST_F(TerminationTest, IsSuggestedWhenNoViewCanGainEnough) {
  const PatchSet patches = PatchesOf({3});
  const Termination below = Judge(patches, Gains(0.1, 0.499));
  EXPECT_TRUE(below.suggested);
  EXPECT_EQ(below.best_gain_without_hidden, 0.1);
  EXPECT_EQ(below.best_gain_without_hidden_upper, 0.499);
  EXPECT_EQ(below.best_model_gain, 0);
  EXPECT_THAT(below.reason,
              HasSubstr("no view brings 0.500 m2 to the required density: the best brings 0.100 m2 "
                        "at least and 0.499 m2 at most"));
  const Termination open = Judge(patches, Gains(0.1, 0.5));
  EXPECT_FALSE(open.suggested);
  EXPECT_THAT(open.reason,
              HasSubstr("brings 0.10 m2 to the required density, less than 0.50 m2, but"));
  const Termination enough = Judge(patches, Gains(0.5, 7));
  EXPECT_FALSE(enough.suggested);
  EXPECT_THAT(enough.reason, HasSubstr("a view brings 0.50 m2 to the required density; stopping"));
}

TEST_F(TerminationTest, TheLeastGainIsTheConfigurations) {
  const PatchSet patches = PatchesOf({3});
  config_.terminate_below = 0.4;
  EXPECT_FALSE(Judge(patches, Gains(0, 0.45)).suggested);
  config_.terminate_below = 0.46;
  EXPECT_TRUE(Judge(patches, Gains(0, 0.45)).suggested);
}

// Nowhere to stand is no reason to stop: somebody may clear the way.
TEST_F(TerminationTest, IsNotSuggestedWhenNoViewWasEvaluated) {
  const Termination end = Judge(PatchesOf({3}), std::nullopt);
  EXPECT_FALSE(end.suggested);
  EXPECT_THAT(end.reason, HasSubstr("3.00 m2 are still deficient, and no view"));
}

TEST_F(TerminationTest, WhatNobodyCanSeeIsToldWhereItIsKnown) {
  const PatchSet patches = PatchesOf({3});
  const Evaluation views = ViewsWithUpper({5000});
  EXPECT_FALSE(Judge(patches, Gains(2, 2)).unobservable_known);
  const Termination known = JudgeTermination(patches, views, config_, 1.25, Gains(2, 2));
  EXPECT_TRUE(known.unobservable_known);
  EXPECT_EQ(known.unobservable_area, 1.25);
}

}  // namespace
}  // namespace vantage::planning
