// Priors that lie by a known factor, beside a room that tells the pose and a corridor that does
// not.
#include "core/registration/bound/prior_consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/sensor/scanner_model.h"
#include "tests/core/registration/shape.h"

namespace vantage::registration {
namespace {

OverlapGeometry RoomGeometry() {
  Shape shape(sensor::Radians(1), 3);
  shape.Rectangle({0, 0, 0}, 5 * kX, 4 * kY, kZ);
  shape.Rectangle({0, 0, 0}, 5 * kX, 2.5 * kZ, kY);
  shape.Rectangle({0, 0, 0}, 4 * kY, 2.5 * kZ, kX);
  return shape.Geometry();
}

// Factors of priors whose errors are `lie` times what they state.
std::vector<double> FactorsOf(const OverlapGeometry& geometry, double lie, int draws) {
  const sensor::Vector6d sigma{{0.02, 0.02, 0.08, 0.3, 0.3, 0.1}};
  std::mt19937_64 random(5);
  std::normal_distribution<double> gauss;
  std::vector<double> factors;
  for (int i = 0; i < draws; ++i) {
    Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
    truth.translate(Eigen::Vector3d(2, 1.5, 1.4));
    truth.rotate(Eigen::AngleAxisd(gauss(random), Eigen::Vector3d::UnitZ()));
    sensor::Vector6d off;
    for (Eigen::Index k = 0; k < 6; ++k) off[k] = lie * sigma[k] * gauss(random);
    sensor::PosePrior prior;
    prior.covariance = sigma.cwiseAbs2().asDiagonal();
    const double angle = off.head<3>().norm();
    prior.T_world_scan.linear() =
        Eigen::AngleAxisd(angle, off.head<3>() / angle).toRotationMatrix() * truth.linear();
    prior.T_world_scan.translation() = truth.translation() + off.tail<3>();
    factors.push_back(PriorVarianceFactor(geometry, truth, prior));
  }
  std::sort(factors.begin(), factors.end());
  return factors;
}

TEST(PriorConsistency, HonestPriorsKeepTheirSigmas) {
  const OverlapGeometry room = RoomGeometry();
  const std::vector<double> factors = FactorsOf(room, 1, 2000);
  const auto ones = std::count(factors.begin(), factors.end(), 1.0);
  EXPECT_NEAR(static_cast<double>(ones) / 2000, 0.95, 0.02);
}

TEST(PriorConsistency, PriorsThatLieAreFoundOut) {
  for (const OverlapGeometry& shape :
       {RoomGeometry(), CorridorShape(sensor::Radians(1), 3).Geometry()}) {
    const std::vector<double> factors = FactorsOf(shape, 3, 2000);
    const auto ones = std::count(factors.begin(), factors.end(), 1.0);
    EXPECT_LT(static_cast<double>(ones) / 2000, 0.08);
    // Three in four are taken to be worse than they are: the median of chi-square of six over its
    // lower quartile is 1.55, of five 1.63.
    EXPECT_NEAR(std::sqrt(factors[1000] / 1.6), 3, 0.3);
    EXPECT_NEAR(static_cast<double>(
                    std::count_if(factors.begin(), factors.end(), [](double f) { return f > 9; })) /
                    2000,
                0.75, 0.04);
  }
}

TEST(PriorConsistency, WhatTheOverlapDoesNotTellSaysNothing) {
  // A floor: three of six directions. Far off along the others is not seen.
  Shape floor(sensor::Radians(1), 3);
  floor.Rectangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 1});
  sensor::PosePrior prior;
  prior.covariance = sensor::Vector6d::Constant(0.01).asDiagonal();
  prior.T_world_scan.translation() = Eigen::Vector3d(2, 2, 1.4);
  Eigen::Isometry3d there = prior.T_world_scan;
  there.translation().x() += 5;
  EXPECT_EQ(PriorVarianceFactor(floor.Geometry(), there, prior), 1);
  there.translation().z() += 0.6;
  EXPECT_NEAR(PriorVarianceFactor(floor.Geometry(), there, prior), 36 / 1.213, 3);
}

}  // namespace
}  // namespace vantage::registration
