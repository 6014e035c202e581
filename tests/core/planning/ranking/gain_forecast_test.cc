#include "core/planning/ranking/gain_forecast.h"

#include <gtest/gtest.h>

#include <random>

namespace vantage::planning {
namespace {

double* PartOf(GainParts& parts, int part) {
  double* const all[] = {&parts.measured, &parts.hidden, &parts.deep, &parts.expected};
  return all[part];
}

GainParts RandomParts(std::mt19937& random) {
  std::exponential_distribution<double> area(0.2);  // m2, 5 in the mean
  std::bernoulli_distribution none(0.3);
  GainParts parts;
  for (int part = 0; part < 4; ++part) *PartOf(parts, part) = none(random) ? 0 : area(random);
  return parts;
}

TEST(GainForecastTest, NothingIsExpectedOfAViewThatGainsNothing) {
  const GainForecast none = ForecastGain({});
  EXPECT_EQ(none.lower, 0);
  EXPECT_EQ(none.expected, 0);
  EXPECT_EQ(none.upper, 0);
}

TEST(GainForecastTest, LiesBetweenItsBounds) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const GainForecast forecast = ForecastGain(RandomParts(random));
    EXPECT_LE(0, forecast.lower);
    EXPECT_LE(forecast.lower, forecast.expected);
    EXPECT_LE(forecast.expected, forecast.upper);
  }
}

TEST(GainForecastTest, WhoGainsMoreOfSomethingIsExpectedToBringMore) {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> which(0, 3);
  for (int i = 0; i < 1000; ++i) {
    const GainParts parts = RandomParts(random);
    GainParts more = parts;
    *PartOf(more, which(random)) += 1;
    EXPECT_GT(ForecastGain(more).expected, ForecastGain(parts).expected);
  }
}

TEST(GainForecastTest, ARoomBehindACurtainBringsMoreThanAShadow) {
  EXPECT_GT(ForecastGain({.deep = 2}).lower, ForecastGain({.hidden = 2}).upper);
}

}  // namespace
}  // namespace vantage::planning
