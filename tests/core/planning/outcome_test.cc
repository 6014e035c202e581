#include "core/planning/outcome.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using ::testing::HasSubstr;

class NowhereToStandTest : public ::testing::Test {
 protected:
  // Of a model that has no feasible view.
  Outcome Of(const model::PlanningView& model) {
    const FeasibleViews views =
        FeasibleViews::Find(model, visibility::OpaqueGrid(model), scanner_, config_, serial_)
            .value();
    EXPECT_TRUE(views.cells().empty());
    Outcome outcome = NowhereToStand(views, scanner_, config_);
    EXPECT_EQ(outcome.kind, PlanOutcome::kNoFeasibleView);
    return outcome;
  }
  const model::PlanningView room_ = test_support::BuildView(test_support::FurnishedRoom(1));
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

TEST_F(NowhereToStandTest, SaysWhichConstraintLeavesNothing) {
  scanner_.clearance = 3;
  EXPECT_THAT(Of(room_).message, HasSubstr("3.00 m of clearance"));
  scanner_.clearance = 0.35;
  config_.keep_out = {Region(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(9, 9, 9))};
  EXPECT_THAT(Of(room_).message, HasSubstr("keep-out"));
}

TEST_F(NowhereToStandTest, SaysThatThereIsNoFloor) {
  EXPECT_THAT(Of(model::PlanningView(0.05, 1, {}, {})).message, HasSubstr("no floor"));
}

TEST_F(NowhereToStandTest, SaysThatNoViewcellFitsIntoTheHeights) {
  config_.min_viewpoint_height = 1.5;
  config_.max_viewpoint_height = 1.51;
  EXPECT_THAT(Of(room_).message, HasSubstr("none lies wholly between 1.50 m and 1.51 m"));
}

TEST(OutcomeTest, WhatIsShownWhileEvaluatingSaysWhatIsChecked) {
  Plan interim;
  interim.seed = 7;
  const Plan shown = StillEvaluating(interim);
  EXPECT_EQ(shown.outcome, PlanOutcome::kViews);
  EXPECT_THAT(shown.message, HasSubstr("not yet checked for registration"));
  EXPECT_EQ(shown.seed, 7u);
  interim.views.emplace_back().checked = true;
  EXPECT_THAT(StillEvaluating(interim).message, HasSubstr("the first view registers"));
}

TEST(OutcomeTest, AnUnfinishedCheckNamesTheBestAndABudgetThatWouldDo) {
  registration::RegistrationVerdict best;
  best.reason = "too little overlap";
  best.remedy = "go nearer";
  const Outcome outcome = UnfinishedAfter(12, &best, 3.4, parallel::Budget::Unlimited());
  EXPECT_EQ(outcome.kind, PlanOutcome::kSearchUnfinished);
  for (const char* part : {"12 views", "too little overlap", "go nearer", "3.4 s"}) {
    EXPECT_THAT(outcome.message, HasSubstr(part));
  }
}

}  // namespace
}  // namespace vantage::planning
