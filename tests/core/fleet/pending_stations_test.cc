// Which station a scan is of, and what a station's scan should bring.
#include "core/fleet/pending_stations.h"

#include <gtest/gtest.h>

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
