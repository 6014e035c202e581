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

// Views that gain at most so many samples each. What is estimated of them is half of that.
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

class TerminationTest : public ::testing::Test {
 protected:
  TerminationTest() {
    config_.required_density = 1000;  // so that 1000 samples are a square metre of model gain
    config_.terminate_below = 0.5;
    config_.min_patch_area = 0.02;
  }
  Termination Judge(const PatchSet& patches, const Evaluation& evaluation) const {
    return JudgeTermination(patches, evaluation, config_, std::nullopt);
  }
  PlanningConfig config_;
};

TEST_F(TerminationTest, IsSuggestedWhenNothingIsMissing) {
  const Termination end = Judge(PatchesOf({}), ViewsWithUpper({}));
  EXPECT_TRUE(end.suggested);
  EXPECT_THAT(end.reason, HasSubstr("required density of 1000"));
  EXPECT_EQ(end.largest_patch_area, 0);
  EXPECT_FALSE(end.best_upper.has_value());
}

// By the largest patch alone, however many there are and whatever a view would gain on them.
TEST_F(TerminationTest, IsSuggestedWhenEveryPatchIsBelowTheLeastArea) {
  const Evaluation much = ViewsWithUpper({5000});
  const Termination below = Judge(PatchesOf({0.0199, 0.0199, 0.0199, 0.0199}), much);
  EXPECT_TRUE(below.suggested);
  EXPECT_THAT(below.reason, HasSubstr("0.0199 m2, less than 0.0200 m2"));
  EXPECT_FALSE(Judge(PatchesOf({0.0199, 0.02}), much).suggested);
}

TEST_F(TerminationTest, TheLeastAreaIsTheConfigurations) {
  const PatchSet patches = PatchesOf({0.3, 0.7, 0.1});
  const Evaluation much = ViewsWithUpper({5000});
  EXPECT_FALSE(Judge(patches, much).suggested);
  config_.min_patch_area = 0.71;
  const Termination end = Judge(patches, much);
  EXPECT_TRUE(end.suggested);
  EXPECT_EQ(end.largest_patch_area, 0.7);
}

// By what the best view may gain, not by what is estimated: that is half of it.
TEST_F(TerminationTest, IsSuggestedWhenNoViewCanGainEnough) {
  const PatchSet patches = PatchesOf({3});
  const Termination below = Judge(patches, ViewsWithUpper({100, 499, 0}));
  EXPECT_TRUE(below.suggested);
  EXPECT_EQ(below.best_upper, 499);
  EXPECT_THAT(below.reason, HasSubstr("exceeds 0.499 m2 (upper bound), less than 0.500 m2"));
  const Termination enough = Judge(patches, ViewsWithUpper({100, 500, 0}));
  EXPECT_FALSE(enough.suggested);
  EXPECT_THAT(enough.reason, HasSubstr("may still be 0.50 m2"));
}

TEST_F(TerminationTest, TheLeastGainIsTheConfigurationsInSquareMetres) {
  const PatchSet patches = PatchesOf({3});
  const Evaluation views = ViewsWithUpper({499});
  config_.terminate_below = 0.4;
  EXPECT_FALSE(Judge(patches, views).suggested);
  // As many samples are less surface where more of them are asked for.
  config_.required_density = 2000;
  EXPECT_TRUE(Judge(patches, views).suggested);
}

// Nowhere to stand is no reason to stop: somebody may clear the way.
TEST_F(TerminationTest, IsNotSuggestedWhenNoViewWasEvaluated) {
  const Termination end = Judge(PatchesOf({3}), ViewsWithUpper({}));
  EXPECT_FALSE(end.suggested);
  EXPECT_THAT(end.reason, HasSubstr("3.00 m2 are still deficient, and no view"));
}

TEST_F(TerminationTest, WhatNobodyCanSeeIsToldWhereItIsKnown) {
  const PatchSet patches = PatchesOf({3});
  const Evaluation views = ViewsWithUpper({5000});
  EXPECT_FALSE(Judge(patches, views).unobservable_known);
  const Termination known = JudgeTermination(patches, views, config_, 1.25);
  EXPECT_TRUE(known.unobservable_known);
  EXPECT_EQ(known.unobservable_area, 1.25);
}

}  // namespace
}  // namespace vantage::planning
