// Which station a scan is of, and what a station's scan should bring.
#include "core/fleet/pending_stations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/planning/evaluate_view.h"
#include "tests/support/closed_form_view.h"

namespace vantage::fleet {
namespace {

TEST(StationOfScanTest, IsTheNearestWithinAMetreAndOnItsStorey) {
  const std::vector<PendingStation> pending = {
      {"", {0, 0, 1.5}}, {"", {0.8, 0, 1.5}}, {"", {5, 0, 1.5}}, {"", {5, 0, 4.3}}};
  EXPECT_EQ(StationOfScan(pending, "", {0.1, 0, 1.5}), 0u);
  EXPECT_EQ(StationOfScan(pending, "", {0.6, 0.2, 1.2}), 1u);
  EXPECT_EQ(StationOfScan(pending, "", {5.9, 0, 1.5}), 2u);
  EXPECT_EQ(StationOfScan(pending, "", {5, 0.3, 4.1}), 3u);
  EXPECT_EQ(StationOfScan(pending, "", {6.1, 0, 1.5}), std::nullopt);
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 2.9}), std::nullopt);
  EXPECT_EQ(StationOfScan({}, "", {0, 0, 1.5}), std::nullopt);
}

TEST(StationOfScanTest, IsNotAnotherScanners) {
  const std::vector<PendingStation> pending = {{"red", {0, 0, 1.5}}, {"", {0.5, 0, 1.5}}};
  EXPECT_EQ(StationOfScan(pending, "red", {0, 0, 1.5}), 0u);
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 1.5}), 0u);
  EXPECT_EQ(StationOfScan(pending, "blue", {0, 0, 1.5}), 1u);
}

TEST(StationOfScanTest, OfTwoAtOnePlaceItIsTheEarlier) {
  const std::vector<PendingStation> pending = {{"", {0, 0, 1.5}}, {"", {0, 0, 1.5}}};
  EXPECT_EQ(StationOfScan(pending, "", {0.3, 0, 1.5}), 0u);
}

// Who turns on the spot makes several stations at one place: each ends with the scan that shows it.
TEST(StationOfScanTest, IsTheOneWhoseSectorTheScanShows) {
  const double span = sensor::Radians(120);
  const std::vector<PendingStation> pending = {{"", {0, 0, 1.5}, sensor::Radians(10), span},
                                               {"", {0.2, 0, 1.5}, sensor::Radians(190), span}};
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 1.5}, sensor::Radians(-15)), 0u);
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 1.5}, sensor::Radians(-165)), 1u);
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 1.5}, sensor::Radians(41)), std::nullopt)
      << "less than three quarters";
  EXPECT_EQ(StationOfScan(pending, "", {0, 0, 1.5}), 0u) << "a heading that nobody knows";
  const std::vector<PendingStation> around = {{"", {0, 0, 1.5}}};
  EXPECT_EQ(StationOfScan(around, "", {0, 0, 1.5}, sensor::Radians(41)), 0u);
}

class ForecastStationTest : public ::testing::Test {
 protected:
  ForecastStationTest() {
    config_.viewcell_size = 0.4;
    config_.max_viewpoint_height = 1.7;
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(3);
    scene.density = [](const Eigen::Vector3d& p) {
      return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    model_ = std::make_shared<model::PlanningView>(test_support::BuildView(scene));
  }
  StationForecast Forecast(const Eigen::Vector3d& position,
                           const std::vector<PledgedView>& before = {}) {
    const auto forecast =
        ForecastStation(*model_, scanner_, config_, position, std::nullopt, before, serial_);
    EXPECT_TRUE(forecast.ok()) << forecast.status();
    return forecast.ok() ? *forecast : StationForecast();
  }

  sensor::ScannerModel scanner_;
  planning::PlanningConfig config_;
  std::shared_ptr<const model::PlanningView> model_;
  parallel::Serial serial_;
};

TEST_F(ForecastStationTest, AloneItIsWhatTheWhatIfSays) {
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(3.8, 3.4, 1.5), Eigen::Vector3d(2.2, 3.0, 1.5)}) {
    const auto what_if = planning::EvaluateView(*model_, scanner_, config_, at, serial_);
    ASSERT_TRUE(what_if.ok()) << what_if.status();
    const StationForecast forecast = Forecast(at);
    ASSERT_GT(forecast.model_gain, 0.5);
    EXPECT_NEAR(forecast.model_gain, what_if->view.model_gain.value(), 1e-3);
    EXPECT_EQ(forecast.registers, what_if->view.verdict.registered());
    EXPECT_EQ(forecast.loss_chance, forecast.registers ? kLossWhereItRegisters : kLossOtherwise);
    EXPECT_FALSE(forecast.waits);
  }
}

TEST_F(ForecastStationTest, CountsWhatViewsBeforeItLeave) {
  const Eigen::Vector3d at(3.8, 3.4, 1.5);
  const double alone = Forecast(at).model_gain;
  const StationForecast again = Forecast(at, {{at, scanner_, {}}});
  EXPECT_LT(again.model_gain, 0.05 * alone) << "the same place twice";
  const StationForecast other = Forecast(at, {{{2.2, 3.0, 1.5}, scanner_, {}}});
  EXPECT_LT(other.model_gain, alone);
  EXPECT_GE(other.model_gain, 0);
}

// Expected rooms are in no model gain, whatever basis plans have.
TEST_F(ForecastStationTest, IsOfWhatIsKnown) {
  config_.station_basis = planning::StationBasis::kExpected;
  const double expected = Forecast({3.8, 3.4, 1.5}).model_gain;
  config_.station_basis = planning::StationBasis::kKnown;
  EXPECT_EQ(Forecast({3.8, 3.4, 1.5}).model_gain, expected);
}

TEST_F(ForecastStationTest, OfASectorItIsWhatThatSees) {
  scanner_.azimuth_span = sensor::Radians(120);
  const Eigen::Vector3d at(2.2, 3.0, 1.5);
  const auto with = [&](std::optional<double> heading, const std::vector<PledgedView>& before) {
    return ForecastStation(*model_, scanner_, config_, at, heading, before, serial_).value();
  };
  double least = 1e9;
  double most = 0;
  double thirds = 0;
  for (const double degrees : {0, 120, 240}) {
    const double heading = sensor::Radians(degrees);
    const double gain = with(heading, {}).model_gain;
    const auto what_if = planning::EvaluateView(*model_, scanner_, config_, at, serial_, heading);
    ASSERT_TRUE(what_if.ok()) << what_if.status();
    EXPECT_NEAR(gain, what_if->view.model_gain.value(), 1e-3);
    least = std::min(least, gain);
    most = std::max(most, gain);
    thirds += gain;
    // The same place facing elsewhere takes nothing of it; facing alike all.
    EXPECT_NEAR(with(heading, {{at, scanner_, heading + sensor::Radians(120)}}).model_gain, gain,
                1e-3);
    EXPECT_LT(with(heading, {{at, scanner_, heading}}).model_gain, 0.05 * gain);
  }
  EXPECT_LT(least, 0.9 * most);
  sensor::ScannerModel around = scanner_;
  around.azimuth_span = 2 * sensor::kPi;
  const auto all = ForecastStation(*model_, around, config_, at, std::nullopt, {}, serial_);
  EXPECT_NEAR(thirds, all.value().model_gain, 1e-3 * thirds);
}

// No scan of a sector shows all around: without a heading it is worth what the one is that a plan
// would choose.
TEST_F(ForecastStationTest, WithoutAHeadingASectorIsNotPromisedAllAround) {
  scanner_.azimuth_span = sensor::Radians(120);
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(3.8, 3.4, 1.5), Eigen::Vector3d(2.2, 3.0, 1.5)}) {
    const StationForecast forecast = Forecast(at);
    const auto what_if = planning::EvaluateView(*model_, scanner_, config_, at, serial_);
    ASSERT_TRUE(what_if.ok()) << what_if.status();
    ASSERT_GT(forecast.model_gain, 0.5);
    EXPECT_NEAR(forecast.model_gain, what_if->view.model_gain.value(), 1e-3);
    EXPECT_EQ(forecast.registers, what_if->view.verdict.registered());
  }
}

TEST_F(ForecastStationTest, WhatIsNotFiniteIsRefused) {
  const double nan = std::nan("");
  EXPECT_EQ(ForecastStation(*model_, scanner_, config_, {nan, 0, 0}, std::nullopt, {}, serial_)
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(
      ForecastStation(*model_, scanner_, config_, {1, 1, 1}, nan, {}, serial_).status().code(),
      absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace vantage::fleet
