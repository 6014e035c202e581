#include "core/tour/make_tour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <stop_token>
#include <vector>

#include "tests/core/tour/flat_tour.h"

namespace vantage::tour {
namespace {

using ::testing::HasSubstr;

// Figures that hang together, and a scan for every stop that registers when its turn comes.
void ExpectSound(const Tour& tour, const TourRequest& request) {
  double area = 0;
  double coverage = tour.coverage_before;
  for (size_t k = 0; k < tour.stops.size(); ++k) {
    const TourStop& stop = tour.stops[k];
    ASSERT_LT(stop.scanner, request.scanners.size());
    EXPECT_TRUE(stop.verdict.registered()) << stop.verdict.reason;
    EXPECT_LE(stop.start, stop.end);
    if (k > 0) {
      EXPECT_LE(tour.stops[k - 1].end, stop.end);
    }
    EXPECT_GE(stop.coverage, coverage - 1e-9);
    coverage = stop.coverage;
    area += stop.area;
    for (const size_t before : stop.registers_with) {
      EXPECT_LT(before, k);
      EXPECT_LE(tour.stops[before].end, stop.start + 1e-9);
    }
    if (!stop.way.empty()) {
      EXPECT_NEAR((stop.way.back() - stop.position).head<2>().norm(), 0, 0.5);
    }
  }
  EXPECT_NEAR(area, tour.area, 1e-6);
  EXPECT_NEAR(coverage, tour.coverage, 1e-9);
  EXPECT_LE(tour.coverage, 1 + 1e-9);
  for (size_t k = 1; k < tour.worth.size(); ++k) {
    EXPECT_EQ(tour.worth[k].scans, tour.worth[k - 1].scans + 1);
    EXPECT_GE(tour.worth[k].area, tour.worth[k - 1].area);
  }
  EXPECT_EQ(tour.worth.empty(), tour.stops.empty());
  if (!tour.worth.empty()) {
    EXPECT_NEAR(tour.worth.back().coverage, tour.coverage, 1e-9);
  }
}

TEST(MakeTourTest, BringsAFlatToTheGoalWithStationsThatRegister) {
  FlatTour flat(3);
  flat.request().goal = 0.98;
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  EXPECT_TRUE(tour.complete);
  EXPECT_TRUE(tour.reaches_goal);
  EXPECT_GE(tour.coverage, 0.96);  // by other cells than it was chosen by
  EXPECT_GE(tour.stops.size(), 3u);
  EXPECT_LE(tour.fewest, tour.stops.size());
  EXPECT_GT(tour.fewest, 0u);
  ASSERT_FALSE(flat.shown().empty());
  EXPECT_TRUE(flat.shown().front().stops.size() > 0);
  EXPECT_FALSE(flat.shown().front().complete);
  EXPECT_THAT(tour.message, HasSubstr("stations, "));
  EXPECT_THAT(tour.message, HasSubstr(" % at 3.16 cm"));
}

TEST(MakeTourTest, NobodyIsSentForLessThanAPlanWouldSendHimFor) {
  FlatTour flat(3);
  flat.request().goal = 0.98;
  const Tour all = flat.Make();
  flat.request().goal.reset();
  const Tour worth = flat.Make();
  ExpectSound(worth, flat.request());
  EXPECT_LE(worth.stops.size(), all.stops.size());
  EXPECT_EQ(worth.fewest, 0u);
  flat.config().terminate_below = 8;
  flat.Prepare();
  const Tour few = flat.Make();
  ExpectSound(few, flat.request());
  EXPECT_LT(few.stops.size(), worth.stops.size());
  // Its least worthwhile station brings what it has to, or others need it.
  ASSERT_GE(few.worth.size(), 2u);
  EXPECT_GT(few.worth.back().area - few.worth[few.worth.size() - 2].area, 4);
}

TEST(MakeTourTest, TheSameOnAnyNumberOfThreads) {
  FlatTour flat(4);
  parallel::Budget budget;
  budget.work_limit = 10'000'000;
  parallel::Serial serial;
  const auto one = flat.Make(budget, serial);
  const auto two = flat.Make(budget, flat.pool());
  ASSERT_TRUE(one.ok() && two.ok());
  ASSERT_EQ(one->stops.size(), two->stops.size());
  for (size_t k = 0; k < one->stops.size(); ++k) {
    EXPECT_EQ(one->stops[k].position, two->stops[k].position);
    EXPECT_EQ(one->stops[k].end, two->stops[k].end);
    EXPECT_EQ(one->stops[k].area, two->stops[k].area);
  }
  EXPECT_EQ(one->rays, two->rays);
  EXPECT_EQ(one->message, two->message);
}

// A scan that is made, stop by stop, with true poses: what it is then.
TEST(MakeTourTest, ScansMadeInItsOrderComeToWhatItSays) {
  FlatTour flat(3);
  const Tour tour = flat.Make();
  size_t registers = 0;
  for (const TourStop& stop : tour.stops) {
    registers += flat.Evaluate(stop.position).view.verdict.registered();
    flat.ScanFrom(stop.position);
  }
  // Rooms are not as they were expected: five in six all the same.
  EXPECT_GE(6 * registers, 5 * tour.stops.size());
  // What was expected is there; what furniture hides was not.
  const Tour after = flat.Make();
  EXPECT_GE(after.coverage_before, 0.55);
  EXPECT_GT(after.area_before, tour.area_before + 0.6 * tour.area);
}

TEST(MakeTourTest, TheBestOfSoManyScans) {
  FlatTour flat(3);
  const Tour all = flat.Make();
  double before = 0;
  for (const size_t scans : {1, 2, 4}) {
    flat.request().scans = scans;
    const Tour tour = flat.Make();
    ExpectSound(tour, flat.request());
    EXPECT_LE(tour.stops.size(), scans);
    EXPECT_GT(tour.area, before);
    EXPECT_LE(tour.area, all.area * 1.03);
    EXPECT_FALSE(tour.open.empty());
    before = tour.area;
  }
}

TEST(MakeTourTest, TheBestOfSoManyMinutes) {
  FlatTour flat(3);
  const Tour all = flat.Make();
  flat.request().minutes = all.minutes / 2;
  const Tour half = flat.Make();
  ExpectSound(half, flat.request());
  EXPECT_LE(half.minutes, all.minutes / 2 + 1e-9);
  EXPECT_GT(half.area, all.area / 2);  // the best half brings more than half
  flat.request().minutes = 1;          // less than one scan takes
  EXPECT_TRUE(flat.Make().stops.empty());
}

TEST(MakeTourTest, TimeThatIsLeftIsNotSpentOnStationsThatAreNotWorthIt) {
  FlatTour flat(3);
  const Tour worth = flat.Make();
  flat.config().terminate_below = 2;
  flat.Prepare();
  flat.request().minutes = 10 * worth.minutes;
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  EXPECT_LE(tour.stops.size(), worth.stops.size());
  // By other cells than it was chosen by, and others may need it.
  ASSERT_GE(tour.worth.size(), 2u);
  EXPECT_GT(tour.worth.back().area - tour.worth[tour.worth.size() - 2].area, 1);
  EXPECT_GT(tour.not_worth_it, 0u);
  EXPECT_THAT(tour.message, HasSubstr("that would bring less than 2 m\u00b2 each"));
  // What nobody is sent for by itself is gone for where it is asked for.
  flat.request().goal = 0.99;
  EXPECT_GT(flat.Make().area, tour.area);
  // Where time is short nothing is left out.
  flat.request().goal.reset();
  flat.request().minutes = worth.minutes / 3;
  EXPECT_EQ(flat.Make().not_worth_it, 0u);
}

TEST(MakeTourTest, TwoScannersAreDoneSooner) {
  FlatTour flat(3);
  const Tour one = flat.Make();
  flat.request().scanners.resize(2, flat.request().scanners.front());
  const Tour two = flat.Make();
  ExpectSound(two, flat.request());
  EXPECT_EQ(two.scanner_minutes.size(), 2u);
  EXPECT_LT(two.minutes, 0.8 * one.minutes);
}

TEST(MakeTourTest, DaysBeginWhereOverlapIsStrongest) {
  FlatTour flat(3);
  const Tour all = flat.Make();
  flat.request().day = all.minutes / 2;
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  EXPECT_GE(tour.stops.back().day, 1);
  for (const TourStop& stop : tour.stops) {
    EXPECT_LE(stop.end, (stop.day + 1) * *flat.request().day + 1e-9);
  }
  const auto first = std::find_if(tour.stops.begin(), tour.stops.end(),
                                  [](const TourStop& stop) { return stop.day == 1; });
  ASSERT_NE(first, tour.stops.end());
  for (auto later = first; later != tour.stops.end() && later->day == 1; ++later) {
    EXPECT_GE(first->start + 1e-9, *flat.request().day);
  }
}

TEST(MakeTourTest, RoomsWithHoursAreEnteredWithinThem) {
  FlatTour flat(3);
  const Tour all = flat.Make();
  const TourStop& stop = all.stops.front();
  RoomHours hours;
  const Eigen::Vector2d at = stop.position.head<2>();
  hours.room.outline = {at + Eigen::Vector2d(-2, -2), at + Eigen::Vector2d(2, -2),
                        at + Eigen::Vector2d(2, 2), at + Eigen::Vector2d(-2, 2)};
  const auto in_room = [&](const Tour& tour) {
    std::vector<TourStop> stops;
    std::copy_if(tour.stops.begin(), tour.stops.end(), std::back_inserter(stops),
                 [&](const TourStop& made) { return hours.room.Contains(made.position); });
    return stops;
  };
  // Later than anybody would come without hours, so that they are what keeps them out.
  hours.open.from = all.minutes / 2;
  ASSERT_FALSE(in_room(all).empty());
  ASSERT_LT(in_room(all).front().start, hours.open.from);
  flat.request().hours = {hours};
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  ASSERT_FALSE(in_room(tour).empty());
  for (const TourStop& made : in_room(tour)) EXPECT_GE(made.start, hours.open.from);
  flat.request().hours[0].open = {0, 1};  // nobody is done by then
  const Tour closed = flat.Make();
  EXPECT_TRUE(in_room(closed).empty());
  EXPECT_FALSE(closed.stops.empty());
  EXPECT_THAT(closed.message, HasSubstr("the room is closed when anybody could be there"));
}

TEST(MakeTourTest, AnEarlierTourIsKeptWhereNothingNewWasLearnt) {
  FlatTour flat(3);
  const Tour first = flat.Make();
  ASSERT_GE(first.stops.size(), 4u);
  flat.ScanFrom(first.stops.front().position);
  for (size_t k = 1; k < first.stops.size(); ++k) {
    flat.request().previous.push_back(first.stops[k].position);
  }
  const Tour next = flat.Make();
  ExpectSound(next, flat.request());
  flat.request().previous.clear();
  const Tour anew = flat.Make();
  EXPECT_LE(next.stops.size(), anew.stops.size() + 1);
  size_t kept = 0;
  for (const TourStop& stop : next.stops) kept += stop.kept;
  EXPECT_EQ(kept, next.kept);
  // The scan from the first stop showed what had been expected, more or less.
  EXPECT_GE(2 * kept, next.stops.size());
}

TEST(MakeTourTest, AnEarlierTourIsKeptOverSeveralDays) {
  FlatTour flat(3);
  const Tour first = flat.Make();
  for (const TourStop& stop : first.stops) flat.request().previous.push_back(stop.position);
  flat.request().day = first.minutes / 2;
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  EXPECT_GE(2 * tour.kept, tour.stops.size());
  EXPECT_GE(tour.stops.back().day, 1);
  for (const TourStop& stop : tour.stops) {
    EXPECT_LE(stop.end, (stop.day + 1) * *flat.request().day + 1e-9);
  }
}

TEST(MakeTourTest, TheTourOfOneScannerLeavesNoneOfTwoIdle) {
  for (const uint64_t seed : {3, 4, 5}) {
    SCOPED_TRACE(seed);
    FlatTour flat(seed);
    const Tour one = flat.Make();
    flat.request().scanners.resize(2, flat.request().scanners.front());
    const Tour anew = flat.Make();
    for (const TourStop& stop : one.stops) flat.request().previous.push_back(stop.position);
    const Tour two = flat.Make();
    ExpectSound(two, flat.request());
    EXPECT_LE(two.minutes, anew.minutes + flat.request().scanners[0].scan_seconds / 60 + 1e-9);
    for (const double minutes : two.scanner_minutes) EXPECT_GT(minutes, two.minutes / 3);
  }
}

TEST(MakeTourTest, AScannerThatSeesASectorIsTurned) {
  FlatTour flat(3);
  flat.UseSector(sensor::Radians(150));
  const Tour tour = flat.Make();
  ExpectSound(tour, flat.request());
  ASSERT_GE(tour.stops.size(), 3u);
  std::vector<double> headings;
  for (const TourStop& stop : tour.stops) {
    ASSERT_TRUE(stop.heading.has_value());
    headings.push_back(*stop.heading);
    // A plan knows nothing of tours, and brings as much with that heading.
    if (&stop != &tour.stops.front()) continue;
    const auto view = flat.Evaluate(stop.position, stop.heading).view;
    EXPECT_NEAR(stop.area, *view.gain_without_hidden, 0.1 * stop.area + 0.5);
    EXPECT_GT(
        stop.area,
        1.2 * *flat.Evaluate(stop.position, *stop.heading + sensor::kPi).view.gain_without_hidden);
  }
  std::sort(headings.begin(), headings.end());
  EXPECT_GT(headings.back() - headings.front(), 1);
  flat.request().previous = {tour.stops.front().position};
  const auto refused = flat.Make(parallel::Budget::Unlimited(), flat.pool());
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("turn all around"));
}

TEST(MakeTourTest, EndsWithAnAnswerWhenTheBudgetDoes) {
  FlatTour flat(3);
  parallel::Budget over = parallel::Budget::Seconds(0);
  const auto tour = flat.Make(over, flat.pool());
  ASSERT_TRUE(tour.ok()) << tour.status();
  EXPECT_FALSE(tour->complete);
  EXPECT_FALSE(tour->stops.empty());
  ExpectSound(*tour, flat.request());
}

TEST(MakeTourTest, StopsWhenCancelled) {
  FlatTour flat(3);
  std::stop_source source;
  source.request_stop();
  parallel::Budget budget;
  budget.cancelled = source.get_token();
  EXPECT_EQ(flat.Make(budget, flat.pool()).status().code(), absl::StatusCode::kCancelled);
}

TEST(MakeTourTest, StopsWhenCancelledOnTheWay) {
  FlatTour flat(3);
  std::stop_source source;
  parallel::Budget budget;
  budget.cancelled = source.get_token();
  size_t told = 0;
  const auto tour =
      MakeTour(flat.problem(), flat.request(), budget, flat.pool(), [&](const Tour& so_far) {
        EXPECT_FALSE(so_far.stops.empty());
        EXPECT_GT(so_far.area, 0);
        ++told;
        source.request_stop();
      });
  // There was a tour, but nobody is told figures that were cut short.
  EXPECT_EQ(told, 1u);
  EXPECT_EQ(tour.status().code(), absl::StatusCode::kCancelled);
}

TEST(MakeTourTest, SaysWhatIsWrongWithARequest) {
  FlatTour flat(3);
  const auto refused = [&](auto change, const char* words) {
    TourRequest asked = flat.request();
    change(flat.request());
    const auto tour = flat.Make(parallel::Budget::Unlimited(), flat.pool());
    EXPECT_EQ(tour.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(tour.status().message()), HasSubstr(words));
    flat.request() = asked;
  };
  refused([](TourRequest& r) { r.scanners.clear(); }, "at least one scanner");
  refused([](TourRequest& r) { r.scanners[0].speed = 0; }, "scanners[0]");
  refused([](TourRequest& r) { r.scanners[0].model.range_max = 5; }, "of another model");
  refused([](TourRequest& r) { r.goal = 1.1; }, "goal");
  refused([](TourRequest& r) { r.minutes = -1; }, "minutes");
  refused([](TourRequest& r) { r.scans = 0; }, "scans");
  refused([](TourRequest& r) { r.day = 0; }, "day");
  refused([](TourRequest& r) { r.hours.resize(1); }, "hours[0].room");
  refused([](TourRequest& r) { r.previous = {Eigen::Vector3d::Constant(NAN)}; }, "previous");
}

}  // namespace
}  // namespace vantage::tour
