#include "client/cli/tour_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::Tour TwoStops() {
  v1::Tour tour;
  for (int k = 0; k < 2; ++k) {
    v1::TourStop& stop = *tour.add_stops();
    stop.mutable_position()->set_x(1.5 * k);
    stop.mutable_end_offset()->set_seconds(240 * (k + 1));
    stop.set_area_m2(10 + k);
    stop.set_coverage(0.4 + 0.2 * k);
    stop.mutable_verdict()->set_outcome(v1::REGISTRATION_OUTCOME_REGISTERED);
    stop.mutable_verdict()->set_overlap_share(0.5);
    stop.mutable_verdict()->set_error_bound_m(0.002);
    v1::TourWorth& worth = *tour.add_worth();
    worth.set_scan_count(k + 1);
    worth.mutable_duration()->set_seconds(240 * (k + 1));
    worth.set_coverage(0.4 + 0.2 * k);
  }
  tour.set_message("2 stations, 8 min, 60 % at 2 cm");
  tour.set_least_stop_count(2);
  tour.set_candidate_count(40);
  tour.set_reaches_goal(true);
  return tour;
}

TEST(TourReportTest, IsATableThatEndsWithWhatItComesTo) {
  const std::string text = TourReport(TwoStops());
  EXPECT_THAT(text, HasSubstr("(1.50, 0.00, 0.00)"));
  EXPECT_THAT(text, HasSubstr("8 min"));
  EXPECT_THAT(text, HasSubstr("\n2 stations, 8 min, 60 % at 2 cm\n"));
  EXPECT_THAT(text, HasSubstr("no choice of these has fewer than 2"));
  EXPECT_THAT(text, HasSubstr("1 scan, 4 min: 40.0 %"));
  // One scanner, one day, one storey: no columns for them.
  EXPECT_THAT(text, Not(HasSubstr("scanner ")));
  EXPECT_THAT(text, Not(HasSubstr("storey")));
  EXPECT_THAT(text, Not(HasSubstr("not reached")));
}

TEST(TourReportTest, SaysWhoAndWhenWhereThatDiffers) {
  v1::Tour tour = TwoStops();
  tour.mutable_stops(0)->set_scanner("sessions/flat/scanners/red");
  tour.mutable_stops(1)->set_scanner("sessions/flat/scanners/blue");
  tour.mutable_stops(1)->set_day_number(1);
  tour.mutable_stops(1)->set_storey_number(2);
  tour.mutable_stops(1)->set_expected(true);
  tour.mutable_stops(1)->mutable_wait_duration()->set_seconds(300);
  tour.set_reaches_goal(false);
  tour.clear_least_stop_count();
  const std::string text = TourReport(tour);
  for (const char* word :
       {"red", "blue", "scanner", "day", "storey", "expected", "waits 5 min", "not reached"}) {
    EXPECT_THAT(text, HasSubstr(word));
  }
  EXPECT_THAT(text, Not(HasSubstr("fewer than")));
}

TEST(TourReportTest, HoursAndMinutesAsPeopleSayThem) {
  EXPECT_EQ(HoursAndMinutes(11400), "3 h 10 min");
  EXPECT_EQ(HoursAndMinutes(7500), "2 h 05 min");
  EXPECT_EQ(HoursAndMinutes(59 * 60 + 20), "59 min");
  EXPECT_EQ(HoursAndMinutes(0), "0 min");
}

}  // namespace
}  // namespace vantage::cli
