// Stations that are worth their scans, on a row of them that hold on to their neighbours.
#include "core/tour/worthwhile_stations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/cover/bonds.h"

namespace vantage::tour {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// One element each, of so many m^2, and neighbours are linked; the first is anchored.
cover::CoverProblem Row(const std::vector<double>& areas) {
  cover::CoverProblem row;
  for (uint32_t i = 0; i < areas.size(); ++i) {
    row.weights.push_back(areas[i]);
    row.covers.push_back(cover::EmptySet(areas.size()));
    cover::Insert(row.covers.back(), i);
    row.links.emplace_back();
    if (i > 0) row.links.back().push_back(i - 1);
    if (i + 1 < areas.size()) row.links.back().push_back(i + 1);
  }
  row.anchored = {0};
  return row;
}

TEST(WorthwhileStationsTest, WhatOthersNeedStays) {
  const cover::CoverProblem row = Row({5, 0.5, 5, 0.7, 0.4});
  std::vector<uint32_t> stations = {0, 1, 2, 3, 4};
  EXPECT_EQ(LeaveOutWhatIsNotWorthIt(row, 1, 0, {}, stations), 2u);
  EXPECT_THAT(stations, ElementsAre(0, 1, 2));
  EXPECT_TRUE(cover::HangTogether(row, stations));
}

TEST(WorthwhileStationsTest, AGoalIsKept) {
  const cover::CoverProblem row = Row({5, 5, 0.7, 0.4});
  std::vector<uint32_t> stations = {0, 1, 2, 3};
  EXPECT_EQ(LeaveOutWhatIsNotWorthIt(row, 1, 10.6, {}, stations), 1u);
  EXPECT_THAT(stations, ElementsAre(0, 1, 2));
}

TEST(WorthwhileStationsTest, OnlyWhatHangsTogetherIsKept) {
  cover::CoverProblem row = Row({5, 5, 5, 5, 5});
  EXPECT_THAT(PartThatHangsTogether(row, {0, 1, 3, 4}), ElementsAre(0, 1));
  EXPECT_THAT(PartThatHangsTogether(row, {3, 4}), IsEmpty());
  // Before the first scan any part may be the first: that which covers most.
  row.anchored.clear();
  EXPECT_THAT(PartThatHangsTogether(row, {0, 2, 3}), ElementsAre(2, 3));
}

// An earlier tour of which one station brings nothing any more that ties another to the rest.
TEST(WorthwhileStationsTest, AnEarlierTourFallsIntoNoPieces) {
  const cover::CoverProblem row = Row({5, 0, 5, 5});
  const std::vector<uint32_t> kept = StationsToKeep(row, {0, 1, 2, 3}, 1, {});
  EXPECT_TRUE(cover::HangTogether(row, kept));
  EXPECT_THAT(kept, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(StationsToKeep(Row({5, 0, 5, 0.3}), {0, 2, 3}, 1, {}), ElementsAre(0));
}

}  // namespace
}  // namespace vantage::tour
