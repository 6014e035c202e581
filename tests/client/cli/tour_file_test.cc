#include "client/cli/tour_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "client/cli/json.h"
#include "vantage/v1/tour.pb.h"

namespace vantage::cli {
namespace {

class TourFileTest : public testing::Test {
 protected:
  std::string Write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_;
  }
  const std::string path_ = testing::TempDir() + "tour_file_test.json";
  ~TourFileTest() override { std::filesystem::remove(path_); }
};

TEST_F(TourFileTest, HasTheStopsInTheirOrder) {
  v1::Tour tour;
  tour.add_stops()->mutable_position()->set_x(1.5);
  tour.add_stops()->mutable_position()->set_x(-2);
  const auto stations = ReadTourStations(Write(ToJson(tour)));
  ASSERT_TRUE(stations.ok()) << stations.status();
  ASSERT_EQ(stations->size(), 2U);
  EXPECT_EQ((*stations)[0].x(), 1.5);
  EXPECT_EQ((*stations)[1].x(), -2);
}

TEST_F(TourFileTest, SaysWhatIsNoTour) {
  const auto plan = ReadTourStations(Write("{\"views\": []}"));
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(plan.status().message()), testing::HasSubstr(path_));
  EXPECT_FALSE(ReadTourStations(path_ + ".none").ok());
}

}  // namespace
}  // namespace vantage::cli
