// Plans and what-ifs for a scanner that sees a sector, and for one whose setting is chosen.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/planner.h"
#include "core/planning/scoring/headings.h"
#include "core/planning/setting_choice.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SectorPlanTest : public ::testing::Test {
 protected:
  SectorPlanTest() : model_(test_support::BuildView(Room())) {
    scanner_.azimuth_span = sensor::Radians(120);
    config_.viewcell_size = 0.3;
  }
  static test_support::ClosedFormScene Room() {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(2);
    scene.density = [](const Eigen::Vector3d& p) {
      return 60000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }
  Plan Make(const sensor::ScannerModel& scanner, parallel::Parallel& parallel,
            uint64_t work_limit = std::numeric_limits<uint64_t>::max()) {
    parallel::Budget budget;
    budget.work_limit = work_limit;
    return MakePlan(model_, scanner, config_, budget, parallel, [](const Plan&) {}).value();
  }
  model::PlanningView model_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

TEST_F(SectorPlanTest, EachViewSaysWhereToFaceAndWhatThatIsWorth) {
  const Plan plan = Make(scanner_, serial_);
  ASSERT_EQ(plan.outcome, PlanOutcome::kViews) << plan.message;
  EXPECT_TRUE(plan.complete);
  const Headings headings(scanner_);
  for (size_t k = 0; k < plan.views.size(); ++k) {
    const RankedView& view = plan.views[k];
    ASSERT_TRUE(view.heading.has_value());
    ASSERT_THAT(view.score_by_heading, SizeIs(headings.size()));
    const auto own = static_cast<size_t>(std::lround(*view.heading / headings.step()));
    EXPECT_NEAR(view.score_by_heading[own], view.score, 1e-6 * view.score);
    EXPECT_TRUE(view.verdict.registered());
    EXPECT_THAT(view.location.description, HasSubstr("facing a bearing of"));
    EXPECT_TRUE(k == 0 || view.score <= plan.views[k - 1].score);
    double kinds = 0;
    for (const double score : view.score_by_kind) kinds += score;
    EXPECT_NEAR(kinds, view.score, 1e-6 * view.score);

    // The what-if of the same heading, and the one that finds it.
    for (const std::optional<double> heading :
         {view.heading, std::optional(*view.heading + 2 * sensor::kPi), std::optional<double>()}) {
      const ViewEvaluation same =
          EvaluateView(model_, scanner_, config_, view.position, serial_, heading).value();
      EXPECT_EQ(same.view.score, view.score);
      EXPECT_NEAR(*same.view.heading, *view.heading, 1e-9);
      EXPECT_EQ(same.view.verdict.error_bound, view.verdict.error_bound);
    }
    // Turned away it gains less.
    const ViewEvaluation away =
        EvaluateView(model_, scanner_, config_, view.position, serial_, *view.heading + sensor::kPi)
            .value();
    EXPECT_LT(away.view.score, view.score);
  }
  // No sector of the room gains more than all around it.
  const Plan around = Make(sensor::ScannerModel{}, serial_);
  EXPECT_GE(around.views[0].score, plan.views[0].score * (1 - 1e-6));
  for (const RankedView& view : around.views) {
    EXPECT_FALSE(view.heading.has_value());
    EXPECT_THAT(view.score_by_heading, IsEmpty());
  }
}

TEST_F(SectorPlanTest, SameOnAnyNumberOfThreads) {
  parallel::ThreadPool pool(5);
  for (const uint64_t limit : {300'000u, 3'000'000u}) {
    const Plan one = Make(scanner_, serial_, limit);
    const Plan other = Make(scanner_, pool, limit);
    EXPECT_EQ(one.rays, other.rays);
    EXPECT_EQ(one.optimality_gap, other.optimality_gap);
    ASSERT_EQ(one.views.size(), other.views.size());
    for (size_t k = 0; k < one.views.size(); ++k) {
      EXPECT_EQ(one.views[k].position, other.views[k].position);
      EXPECT_EQ(one.views[k].heading, other.views[k].heading);
      EXPECT_EQ(one.views[k].score, other.views[k].score);
    }
  }
}

TEST_F(SectorPlanTest, AHeadingThatIsNoneIsAnError) {
  for (const double heading : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    const absl::Status status =
        EvaluateView(model_, scanner_, config_, {2, 2, 1.5}, serial_, heading).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("heading"));
  }
}

// Whether a setting pays is told by the plans of each setting alone.
TEST_F(SectorPlanTest, TheSettingIsChosenByWhatAMinuteGains) {
  std::vector<SettingOption> options(2);
  options[0].name = "fine";
  options[0].scanner.azimuth_step = options[0].scanner.elevation_step = sensor::Radians(0.2);
  options[1].name = "quick";
  options[1].scanner.azimuth_step = options[1].scanner.elevation_step = sensor::Radians(0.6);
  const auto choose = [&](double fine, double quick) {
    options[0].minutes = fine;
    options[1].minutes = quick;
    return MakePlanChoosingSetting(model_, options, config_, parallel::Budget::Unlimited(), serial_,
                                   [](const Plan&) {})
        .value();
  };
  const double fine = Make(options[0].scanner, serial_).views[0].score;
  const double quick = Make(options[1].scanner, serial_).views[0].score;
  ASSERT_GT(fine, quick);
  const double pays = fine / quick;  // times the minutes, the one of setting up included
  const Plan finely = choose(2 * pays * 0.9 - 1, 1);
  ASSERT_EQ(finely.outcome, PlanOutcome::kViews);
  EXPECT_EQ(finely.views[0].setting, "fine");
  EXPECT_EQ(finely.views[0].score, fine);
  EXPECT_DOUBLE_EQ(*finely.views[0].score_per_minute, fine / (2 * pays * 0.9));
  const Plan quickly = choose(2 * pays * 1.1 - 1, 1);
  EXPECT_EQ(quickly.views[0].setting, "quick");
  EXPECT_EQ(*quickly.views[0].scan_minutes, 1);
  EXPECT_EQ(quickly.optimality_gap, 0);
  for (const Plan& plan : {finely, quickly}) {
    for (size_t i = 1; i < plan.views.size(); ++i) {
      EXPECT_LE(*plan.views[i].score_per_minute, *plan.views[i - 1].score_per_minute);
      for (size_t j = 0; j < i; ++j) {
        EXPECT_GE((plan.views[i].position - plan.views[j].position).norm(),
                  config_.candidate_separation);
      }
    }
  }
  EXPECT_EQ(MakePlanChoosingSetting(model_, {}, config_, parallel::Budget::Unlimited(), serial_,
                                    [](const Plan&) {})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace vantage::planning
