// Accuracy of measured surface, against what follows in closed form or by drawing errors.
#include "core/registration/graph/surface_accuracy.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <stop_token>

#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

// The 95 % quantile of the lengths of errors that are drawn.
double Drawn95(const Eigen::Matrix3d& covariance) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d root = (covariance + 1e-18 * Eigen::Matrix3d::Identity()).llt().matrixL();
  std::vector<double> lengths;
  lengths.reserve(100'000);
  for (int i = 0; i < 100'000; ++i) {
    lengths.push_back(
        (root * Eigen::Vector3d(normal(random), normal(random), normal(random))).norm());
  }
  std::nth_element(lengths.begin(), lengths.begin() + 95'000, lengths.end());
  return lengths[95'000];
}

TEST(SurfaceAccuracy, BoundsAreThoseOfDrawnErrors) {
  const double s = 0.004;
  const auto diagonal = [s](double a, double b, double c) {
    return Eigen::Matrix3d(Eigen::Vector3d(a * s * s, b * s * s, c * s * s).asDiagonal());
  };
  EXPECT_NEAR(Bound95(diagonal(1, 0, 0)), 1.95996 * s, 1e-6);
  EXPECT_NEAR(Bound95(diagonal(1, 1, 0)), 2.44775 * s, 1e-6);
  EXPECT_NEAR(Bound95(diagonal(1, 1, 1)), 2.79548 * s, 1e-6);
  EXPECT_EQ(Bound95(Eigen::Matrix3d::Zero()), 0);
  for (const Eigen::Matrix3d& covariance :
       {diagonal(1, 0.5, 0), diagonal(1, 0.1, 0.1), diagonal(1, 0.5, 0.25), diagonal(1, 1, 0.2)}) {
    const double drawn = Drawn95(covariance);
    EXPECT_NEAR(Bound95(covariance), drawn, 0.04 * drawn) << covariance;
  }
}

TEST(SurfaceAccuracy, TurningMovesPointsByTheirDistance) {
  PoseCovariance covariance = PoseCovariance::Zero();
  covariance(2, 2) = 1e-6;                                                  // 1 mrad about z
  EXPECT_NEAR(PointCovariance(covariance, {10, 0, 3})(1, 1), 1e-4, 1e-12);  // 10 mm along y
  EXPECT_NEAR(PointCovariance(covariance, {10, 0, 3}).trace(), 1e-4, 1e-12);
  covariance(3, 3) = 4e-6;
  EXPECT_NEAR(PointCovariance(covariance, {10, 0, 3})(0, 0), 4e-6, 1e-12);
}

class InABareRoom : public testing::Test {
 protected:
  static constexpr double kSigma = 0.005;

  static PoseCovariance Moved(double sigma) {
    PoseCovariance covariance = PoseCovariance::Zero();
    covariance.bottomRightCorner<3, 3>().diagonal().setConstant(sigma * sigma);
    return covariance;
  }
  std::optional<SurfaceAccuracies> Measure(const std::vector<KnownStation>& stations,
                                           const parallel::Cancellation& cancelled = {}) const {
    // East and west.
    return MeasureSurfaceAccuracy(
        Room(), stations, [](size_t, double) { return 0.0; }, 2,
        [](const Eigen::Vector3d& at) { return std::optional<size_t>(at.x() < 0 ? 0 : 1); }, 50'000,
        cancelled);
  }

  static const model::PlanningView& Room() {
    static const auto& room =
        *new auto(ModelOf(BareRoom(), PoseAt({0.2, 0.1, 1.5}, 0), ScanSettings(), 0, 1));
    return *room;
  }

  const Eigen::Vector3d at_{0.2, 0.1, 1.5};
};

TEST_F(InABareRoom, OneStationGivesAllSurfaceItsOwn) {
  const auto accuracy = Measure({{at_, Moved(kSigma), 20}});
  ASSERT_TRUE(accuracy.has_value());
  for (const SurfaceAccuracy& of : {accuracy->groups[0], accuracy->groups[1], accuracy->all}) {
    ASSERT_TRUE(of.bound.has_value());
    EXPECT_NEAR(*of.bound, 2.79548 * kSigma, 1e-5);
    EXPECT_EQ(of.area_unknown, 0);
  }
  EXPECT_NEAR(accuracy->groups[0].area + accuracy->groups[1].area, accuracy->all.area, 1e-9);
  EXPECT_GT(accuracy->all.area, 60);
}

TEST_F(InABareRoom, SurfaceBelongsToTheNearestStationThatSeesIt) {
  // In the west a good one, in the east a bad one; and one that stands behind the wall.
  const Eigen::Vector3d west(-1.5, 0, 1.5);
  const Eigen::Vector3d east(1.5, 0, 1.5);
  const Eigen::Vector3d behind(-3.4, 0, 1.5);
  const auto accuracy = Measure(
      {{west, Moved(kSigma), 20}, {east, Moved(3 * kSigma), 20}, {behind, Moved(10 * kSigma), 20}});
  ASSERT_TRUE(accuracy.has_value());
  EXPECT_NEAR(*accuracy->groups[0].bound, 2.79548 * kSigma, 0.1 * kSigma);
  EXPECT_NEAR(*accuracy->groups[1].bound, 2.79548 * 3 * kSigma, 0.1 * kSigma);
  // 95 % of all points: between the two.
  EXPECT_GT(*accuracy->all.bound, 2.79548 * kSigma);
  EXPECT_LT(*accuracy->all.bound, 2.79548 * 3 * kSigma);
}

TEST_F(InABareRoom, WhatIsNotKnownIsSaid) {
  const auto accuracy = Measure({{{-1.5, 0, 1.5}, Moved(kSigma), 20}, {{1.5, 0, 1.5}, {}, 20}});
  ASSERT_TRUE(accuracy.has_value());
  // A voxel or two about the middle belong to the other.
  EXPECT_LT(accuracy->groups[0].area_unknown, 2);
  EXPECT_LT(accuracy->groups[1].area, 2);
  EXPECT_GT(accuracy->groups[1].area_unknown, 20);
  const auto none = Measure({});
  ASSERT_TRUE(none.has_value());
  EXPECT_FALSE(none->all.bound.has_value());
  EXPECT_GT(none->all.area_unknown, 60);
}

TEST_F(InABareRoom, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(Measure({{at_, Moved(kSigma), 20}}, parallel::Cancellation(stop.get_token())));
}

}  // namespace
}  // namespace vantage::registration
