// Instruments that cannot meet what is required of them, by their sheets and by their residuals.
#include "core/registration/bound/instrument_limit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"
#include "tests/core/registration/shape.h"

namespace vantage::registration {
namespace {

// As if every block of surface were off by this much (m).
InstrumentResiduals Showing(double shared) {
  PairResiduals pair{};
  for (ClassResiduals& of : pair) of = {1e6, 1e6 * shared * shared, 1e7, 0, 0};
  InstrumentResiduals shown;
  shown.Add(pair);
  return shown;
}

std::vector<OverlapElement> RoomElements() {
  Shape shape(sensor::Radians(2), 3);
  shape.Rectangle({-2, -2, 0}, 4 * kX, 4 * kY, kZ);
  shape.Rectangle({-2, -2, 0}, 4 * kX, 2.5 * kZ, kY);
  shape.Rectangle({-2, 2, 0}, 4 * kX, 2.5 * kZ, -kY);
  shape.Rectangle({-2, -2, 0}, 4 * kY, 2.5 * kZ, kX);
  shape.Rectangle({2, -2, 0}, 4 * kY, 2.5 * kZ, -kX);
  std::vector<OverlapElement> elements;
  for (const Constraint& c : shape.points()) {
    elements.push_back({c.position.cast<float>(), c.normal.cast<float>(), 5.0f, 5});
  }
  return elements;
}

const Eigen::Vector3d kAt(0.3, -0.2, 1.4);

TEST(InstrumentLimit, WhatWasLearnedCountsAsIfItWereConfigured) {
  const auto elements = RoomElements();
  const sensor::ScannerModel scanner;
  RegistrationConfig learned;
  learned.instrument = Showing(0.02);
  RegistrationConfig configured;
  configured.correlated_sigma = 0.02;
  const ExpectedBounds by_learning = BoundsOf(elements, 1, kAt, scanner, learned);
  const ExpectedBounds by_setting = BoundsOf(elements, 1, kAt, scanner, configured);
  EXPECT_NEAR(by_learning.bound / by_setting.bound, 1, 1e-3);
  EXPECT_DOUBLE_EQ(by_learning.by_sheet,
                   BoundsOf(elements, 1, kAt, scanner, RegistrationConfig()).bound);
  EXPECT_LT(5 * by_learning.by_sheet, by_learning.bound);
  // The prediction is of the same.
  const RegistrationVerdict v = PredictRegistration(
      elements, 1, 5.0 * static_cast<double>(elements.size()), kAt, scanner, learned);
  EXPECT_DOUBLE_EQ(v.judged_bound, by_learning.bound);
  EXPECT_EQ(BasesText(v.bases), "residuals");
  EXPECT_NE(v.reason.find("data sheet"), std::string::npos) << v.reason;
  EXPECT_FALSE(v.registered());
  learned.required_accuracy = 1.3 * v.judged_bound;
  EXPECT_TRUE(PredictRegistration(elements, 1, 5.0 * static_cast<double>(elements.size()), kAt,
                                  scanner, learned)
                  .registered());
}

TEST(InstrumentLimit, BlamesTheInstrumentAndNotTheShape) {
  const sensor::ScannerModel scanner;
  const RegistrationConfig config;  // 10 mm
  EXPECT_FALSE(AttainableInstead({0.008, 0.003}, scanner, config).has_value());
  EXPECT_EQ(AttainableInstead({0.026, 0.004}, scanner, config), 0.026);
  // Weak by its shape, by the sheet already; of another instrument it would be the sheet.
  EXPECT_FALSE(AttainableInstead({0.026, 0.015}, scanner, config).has_value());
  sensor::ScannerModel coarse;
  coarse.range_noise = 0.5;
  EXPECT_EQ(AttainableInstead({0.026, 0.015}, coarse, config), 0.026);
  // Open by its shape.
  EXPECT_FALSE(AttainableInstead({10, 10}, coarse, config).has_value());
}

TEST(InstrumentLimit, AnyPresetMeetsTheDefaultInAClosedRoom) {
  const RegistrationConfig config;
  EXPECT_LT(ClosedRoomBound(sensor::ScannerModel(), config), 0.004);
  sensor::ScannerModel sector;
  sector.azimuth_span = sensor::Radians(90);
  EXPECT_LT(ClosedRoomBound(sector, config), 0.008);
  // The bound grows in proportion to what it is made of.
  RegistrationConfig twice = config;
  twice.correlated_sigma *= 2;
  sensor::ScannerModel noisy;
  noisy.range_noise *= 2;
  noisy.range_noise_ppm *= 2;
  twice.normal_sigma = config.normal_sigma;
  EXPECT_NEAR(ClosedRoomBound(noisy, twice) / ClosedRoomBound(sensor::ScannerModel(), config), 2,
              0.02);
}

TEST(InstrumentLimit, SaysWhatCanAndWhatToSet) {
  const RegistrationConfig config;
  EXPECT_EQ(InstrumentLimitReason(0.0257, config),
            "the required accuracy of 10 mm cannot be met with this instrument: about 26 mm can");
  EXPECT_EQ(InstrumentLimitRemedy(0.025),
            "set required_accuracy to 0.03 or more (m), or use targets");
}

// A furnished room whose surfaces are off by `shared` (m, one sigma) in cubes of half a metre, in
// each scan anew.
sensor::Scan Deformed(sensor::Scan scan, const Eigen::Isometry3d& pose, double shared,
                      unsigned seed) {
  for (int column = 0; column < scan.image.columns(); ++column) {
    for (int row = 0; row < scan.image.rows(); ++row) {
      float& range = scan.image.range[scan.image.Index(column, row)];
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d p =
          pose * Eigen::Vector3d((range * scan.image.Direction(column, row)).cast<double>());
      const Eigen::Array3i cell = ((p.array() + 0.13) / 0.5).floor().cast<int>();
      std::seed_seq of{static_cast<int>(seed), cell.x(), cell.y(), cell.z()};
      std::mt19937 random(of);
      range += static_cast<float>(shared * std::normal_distribution<double>()(random));
    }
  }
  return scan;
}

// A model, and a scan beside its station.
class InstrumentLimitOfScans : public testing::Test {
 protected:
  explicit InstrumentLimitOfScans(unsigned seed = 5)
      : scene_(FurnishedRoom(seed)),
        model_(ModelFromScan(scene_, PoseAt({0.4, 0.5, 1.4}, 0.3), {}, 100 + seed)),
        second_(PoseAt({-0.7, -0.4, 1.5}, 1.1)),
        scan_(ScanScene(scene_, second_, {}, 200 + seed)) {}

  RegistrationResult Registered(const sensor::Scan& scan, const RegistrationConfig& config) {
    sensor::PosePrior prior;
    prior.T_world_scan = second_;
    prior.T_world_scan.translation() += Eigen::Vector3d(0.03, -0.02, 0.01);
    const auto result = Register(*model_, scan, prior, config, pool_);
    EXPECT_TRUE(result.ok()) << result.status();
    return *result;
  }
  BoxScene scene_;
  std::shared_ptr<const model::PlanningView> model_;
  Eigen::Isometry3d second_;
  sensor::Scan scan_;
  parallel::ThreadPool pool_{2};
};

TEST_F(InstrumentLimitOfScans, NothingIsLearnedOfNoiseAsOnTheSheet) {
  const RegistrationResult result = Registered(scan_, {});
  EXPECT_TRUE(result.verdict.registered()) << result.verdict.reason;
  ASSERT_TRUE(result.residuals.has_value());
  RegistrationConfig config;
  config.instrument.Add(*result.residuals);
  ASSERT_EQ(config.instrument.scans(), 1u);
  for (const double variance : config.instrument.Excess(config.correlated_sigma).shared) {
    EXPECT_EQ(variance, 0);
  }
  EXPECT_EQ(Registered(scan_, config).verdict.judged_bound, result.verdict.judged_bound);
}

TEST_F(InstrumentLimitOfScans, ErrorsThatNeighboursShareAreFoundAndSaid) {
  RegistrationConfig config;
  config.required_accuracy = 0.005;
  const sensor::Scan deformed = Deformed(scan_, second_, 0.03, 5);
  const RegistrationResult result = Registered(deformed, config);
  const RegistrationVerdict& v = result.verdict;
  EXPECT_FALSE(v.registered());
  EXPECT_EQ(BasesText(v.bases), "residuals") << v.reason;
  ASSERT_TRUE(v.attainable_accuracy.has_value()) << v.reason;
  EXPECT_NE(v.reason.find("cannot be met with this instrument"), std::string::npos) << v.reason;
  EXPECT_NE(v.remedy.find("required_accuracy"), std::string::npos) << v.remedy;
  EXPECT_TRUE(Registered(scan_, config).verdict.registered());
  // Of the errors, which are of the range, the residual shows what lies along the normal. They end
  // elsewhere than the blocks do, and are added up across these: one draw of some hundred cells
  // tells that to a fifth.
  ASSERT_TRUE(result.residuals.has_value());
  RegistrationConfig learned = config;
  learned.instrument.Add(*result.residuals);
  const InstrumentExcess excess = learned.instrument.Excess(config.correlated_sigma);
  const double found = std::sqrt(excess.shared[ResidualClass(3, std::cos(sensor::Radians(20)))]);
  EXPECT_GT(found, 0.015);
  EXPECT_LT(found, 1.2 * 0.03);
  // The figure can, and half of it cannot: not this scan, nor a good one by the same instrument.
  learned.required_accuracy = 1.3 * *v.attainable_accuracy;
  EXPECT_TRUE(Registered(deformed, learned).verdict.registered());
  EXPECT_FALSE(Registered(deformed, learned).verdict.attainable_accuracy.has_value());
  learned.required_accuracy = 0.5 * *v.attainable_accuracy;
  EXPECT_FALSE(Registered(deformed, learned).verdict.registered());
  EXPECT_FALSE(Registered(scan_, learned).verdict.registered());
}

TEST_F(InstrumentLimitOfScans, OfAScanInDoubtForAnythingElseNothingIsLearned) {
  sensor::PosePrior elsewhere;
  elsewhere.T_world_scan = PoseAt({2.4, 2.0, 1.5}, 2.6);
  elsewhere.trusted = true;
  elsewhere.covariance = 1e-4 * sensor::Matrix6d::Identity();
  const auto contradicted = Register(*model_, scan_, elsewhere, {}, pool_);
  ASSERT_TRUE(contradicted.ok()) << contradicted.status();
  EXPECT_FALSE(contradicted->verdict.registered());
  EXPECT_FALSE(contradicted->residuals.has_value());
}

}  // namespace
}  // namespace vantage::registration
