#include "client/cli/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Report, WhereNoFloorIsKnownBelowThereIsNoHeightOverIt) {
  v1::Plan plan;
  plan.set_state(v1::PLAN_STATE_SUCCEEDED);
  v1::RankedView& view = *plan.mutable_result()->add_views();
  view.set_height_over_floor_m(std::numeric_limits<double>::quiet_NaN());
  view.set_clearance_m(0.5);
  const std::string report = PlanReport(plan);
  EXPECT_THAT(report, Not(HasSubstr("nan")));
  EXPECT_THAT(report, HasSubstr("station    no floor is known below, clearance 50.0 cm"));
  view.set_height_over_floor_m(1.45);
  EXPECT_THAT(PlanReport(plan), HasSubstr("station    1.45 m over the floor"));
}

TEST(Report, RoomsThatWereNotEnteredAreCounted) {
  v1::Coverage coverage;
  EXPECT_THAT(CoverageReport(coverage), Not(HasSubstr("entered")));  // nobody looked
  coverage.set_rooms_not_entered_count(0);
  EXPECT_THAT(CoverageReport(coverage),
              HasSubstr("no doorway to a room that was not entered is known"));
  coverage.set_rooms_not_entered_count(1);
  EXPECT_THAT(CoverageReport(coverage), HasSubstr("at least 1 room not entered:"));
  coverage.set_rooms_not_entered_count(2);
  EXPECT_THAT(CoverageReport(coverage), HasSubstr("at least 2 rooms not entered:"));
}

// Nothing known to be attainable is not the same as nothing attained.
TEST(Report, ACoverageThatIsNotKnownIsNoFigure) {
  v1::Coverage coverage;
  coverage.add_regions()->set_name("hall");
  coverage.set_pending_station_count(1);
  const std::string report = CoverageReport(coverage);
  EXPECT_THAT(report, HasSubstr("coverage - (estimated)"));
  EXPECT_THAT(report, HasSubstr("region hall: -, "));
  EXPECT_THAT(report, HasSubstr("to -\n"));
  EXPECT_THAT(report, Not(HasSubstr("%")));
  coverage.set_estimated_coverage(0);
  EXPECT_THAT(CoverageReport(coverage), HasSubstr("coverage 0.0 % (estimated)"));
}

// A person is told which poses there are, what is proposed and why, and how to accept exactly that.
TEST(Report, APoseThatIsProposedIsNamedWithWhatDecides) {
  v1::Scan scan;
  scan.set_name("sessions/hall/scans/scan-2");
  scan.set_state(v1::SCAN_STATE_DOUBTFUL);
  scan.set_etag("3f9a01c7");
  v1::Registration& aligned = *scan.mutable_registration();
  aligned.mutable_pose()->mutable_translation()->set_x(-4);
  aligned.mutable_pose()->mutable_rotation()->set_w(1);
  v1::RivalPose& rival = *aligned.add_rival_poses();
  rival.mutable_pose()->mutable_translation()->set_x(4);
  rival.mutable_pose()->mutable_rotation()->set_w(1);
  rival.set_distance_m(8);
  rival.set_fit_share(1);
  std::string report = ScanReport(scan);
  EXPECT_THAT(report, HasSubstr("pose 2    (4.000"));
  EXPECT_THAT(report, HasSubstr("accept hall/scan-2 --pose N --seen 3f9a01c7 takes one of them"));
  EXPECT_THAT(report, Not(HasSubstr("proposed")));

  v1::PoseProposal& proposal = *scan.mutable_pose_proposal();
  proposal.set_rival_pose(1);
  *proposal.mutable_registration()->mutable_pose() = rival.pose();
  proposal.mutable_registration()->mutable_pose()->mutable_translation()->set_x(4.002);
  proposal.set_message("by scan-4 the second of its 2 poses is right");
  report = ScanReport(scan);
  EXPECT_THAT(report, HasSubstr("proposed  pose 2, now (4.002"));
  EXPECT_THAT(report, HasSubstr("by scan-4 the second of its 2 poses is right"));
  EXPECT_THAT(report,
              HasSubstr("accept hall/scan-2 --proposed --seen 3f9a01c7 takes what is proposed"));
}

}  // namespace
}  // namespace vantage::cli
