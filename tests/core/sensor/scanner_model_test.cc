#include "core/sensor/scanner_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace vantage::sensor {
namespace {

// algorithm.md section 3: s = cos i / (da de cos e r^2).
TEST(ScannerModelTest, SamplingDensityIsTheFormulaByAngleAndBySine) {
  ScannerModel scanner;
  scanner.azimuth_step = Radians(0.2);
  scanner.elevation_step = Radians(0.25);
  for (double degrees = -60; degrees < 89; degrees += 3.7) {
    const double elevation = Radians(degrees);
    const double expected = 0.7 / (Radians(0.2) * Radians(0.25) * std::cos(elevation) * 9);
    EXPECT_NEAR(scanner.SamplingDensity(elevation, 0.7, 3), expected, 1e-9 * expected);
    EXPECT_NEAR(scanner.SamplingDensityAtSine(std::sin(elevation), 0.7, 3), expected,
                1e-9 * expected);
  }
}

TEST(ScannerModelTest, TurnsAllAroundWhereHalfAStepIsMissingAtMost) {
  ScannerModel scanner;
  scanner.azimuth_step = Radians(0.4);
  for (const auto& [degrees, all_around] : {std::pair(360.0, true), std::pair(359.81, true),
                                            std::pair(359.79, false), std::pair(120.0, false)}) {
    scanner.azimuth_span = Radians(degrees);
    EXPECT_EQ(scanner.TurnsAllAround(), all_around) << degrees;
  }
}

// Overhead the grid only oversamples in azimuth: no denser than one step from the zenith.
TEST(ScannerModelTest, SamplingDensityIsCappedOverhead) {
  const ScannerModel scanner;
  const double cap =
      1 / (scanner.azimuth_step * scanner.elevation_step * std::sin(scanner.elevation_step));
  for (const double away : {0.0, 0.1, 0.5, 1.0}) {  // of a step
    const double elevation = Radians(90) - away * scanner.elevation_step;
    EXPECT_NEAR(scanner.SamplingDensity(elevation, 1, 1), cap, 1e-6 * cap) << away;
    EXPECT_NEAR(scanner.SamplingDensityAtSine(std::sin(elevation), 1, 1), cap, 1e-6 * cap) << away;
  }
  EXPECT_EQ(scanner.SamplingDensityAtSine(0.5, 0, 1), 0);
  EXPECT_EQ(scanner.SamplingDensityAtSine(0.5, 1, 0), 0);
}

}  // namespace
}  // namespace vantage::sensor
