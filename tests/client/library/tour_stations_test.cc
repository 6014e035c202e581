#include "client/library/tour_stations.h"

#include <gtest/gtest.h>

#include <vector>

namespace vantage::client {
namespace {

TEST(TourStationsTest, AsManyAsAPlanTakesAndThoseThatComeNext) {
  std::vector<v1::Vector3> stations(300);
  for (size_t k = 0; k < stations.size(); ++k) stations[k].set_x(static_cast<double>(k));
  v1::Plan plan;
  SetTourStations(stations, plan);
  ASSERT_EQ(plan.tour_stations_size(), 256);
  EXPECT_EQ(plan.tour_stations(0).x(), 0);
  EXPECT_EQ(plan.tour_stations(255).x(), 255);
  SetTourStations(std::vector<v1::Vector3>(stations.begin(), stations.begin() + 2), plan);
  EXPECT_EQ(plan.tour_stations_size(), 2);
}

}  // namespace
}  // namespace vantage::client
