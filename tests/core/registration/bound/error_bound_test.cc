// Closed-form shapes, for each of which the open directions are known without computation.
#include "core/registration/bound/error_bound.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/registration/align/correlation_block.h"
#include "core/registration/bound/direction_words.h"
#include "core/sensor/scanner_model.h"
#include "tests/core/registration/shape.h"

namespace vantage::registration {
namespace {

const sensor::Matrix6d kNothing = sensor::Matrix6d::Zero();

class NoisyShapes : public testing::TestWithParam<double> {};  // rad, noise of the normals

TEST_P(NoisyShapes, CorridorSlidesAlongItsAxisWhateverItsNormalsSay) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const ErrorBound e = CorridorShape(GetParam(), seed).Geometry().Bound(kNothing);
    EXPECT_GT(e.bound, 5.0) << "seed " << seed;
    EXPECT_GT(std::abs(e.weakest[3]), 0.99 * e.weakest.norm()) << "seed " << seed;
    EXPECT_LT(e.strength, 0.01);
    EXPECT_EQ(DescribeDirection(e.weakest, 4).direction, "sliding along x");
  }
}

TEST_P(NoisyShapes, CorridorIsConstrainedInTheOtherFive) {
  const OverlapGeometry g = CorridorShape(GetParam(), 3).Geometry();
  EXPECT_EQ(g.constrained_directions(), 5);
}

TEST_P(NoisyShapes, DoorJambCuresTheCorridor) {
  Shape shape = CorridorShape(GetParam(), 5);
  shape.Rectangle({1, 0.2, 0}, 0.8 * kY, 2.5 * kZ, -kX);
  const OverlapGeometry g = shape.Geometry();
  EXPECT_EQ(g.constrained_directions(), 6);
  EXPECT_LT(g.Bound(kNothing).bound, 0.010);
}

TEST(ErrorBound, OneSmallPlaceDoesNotCureACorridor) {
  Shape shape = CorridorShape(0, 5);
  shape.Rectangle({1, -1, 1.1}, 0.15 * kY, 0.6 * kZ, -kX);  // as many points, in two blocks
  EXPECT_EQ(shape.Geometry().constrained_directions(), 5);
}

TEST(ErrorBound, OpenIsWhatTheGeometryLeavesOpen) {
  const OverlapGeometry g = CorridorShape(sensor::Radians(2), 3).Geometry();
  const sensor::Matrix6d open = g.Open();
  // Along the axis it says more than the geometry does across, elsewhere nothing.
  EXPECT_GT(open(3, 3), 10 * g.information()(4, 4));
  const double across = open.bottomRightCorner<2, 2>().norm();
  EXPECT_LT(across, 1e-3 * open(3, 3));
  Shape corner(sensor::Radians(2), 13);
  corner.Rectangle({0, 0, 0}, 3 * kX, 3 * kY, kZ).Rectangle({0, 0, 0}, 3 * kX, 2.5 * kZ, kY);
  corner.Rectangle({0, 0, 0}, 3 * kY, 2.5 * kZ, kX);
  EXPECT_EQ(corner.Geometry().Open(), kNothing);
}

TEST_P(NoisyShapes, SingleWallLeavesThreeDirectionsOpen) {
  Shape shape(GetParam(), 7);
  shape.Rectangle({0, -2, 0}, 4 * kY, 2.5 * kZ, kX);
  const OverlapGeometry g = shape.Geometry();
  EXPECT_EQ(g.constrained_directions(), 3);
  EXPECT_GT(g.Bound(kNothing).bound, 5.0);
}

TEST_P(NoisyShapes, SphereTurns) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Shape shape(GetParam(), seed);
    for (int i = 0; i < 6000; ++i) {  // a Fibonacci sphere of 1 m
      const double z = 1 - (2 * i + 1) / 6000.0;
      const double a = i * sensor::kPi * (3 - std::sqrt(5.0));
      const Eigen::Vector3d n(std::sqrt(1 - z * z) * std::cos(a),
                              std::sqrt(1 - z * z) * std::sin(a), z);
      shape.Add(n + Eigen::Vector3d(5, 2, 1), n);
    }
    const OverlapGeometry g = shape.Geometry();
    EXPECT_EQ(g.constrained_directions(), 3) << "seed " << seed;
    const ErrorBound e = g.Bound(kNothing);
    EXPECT_GT(e.bound, 5.0);
    EXPECT_GT(e.weakest.head<3>().norm(), 10 * e.weakest.tail<3>().norm());
    // The sphere's centre itself is known well.
    EXPECT_LT(std::sqrt(e.covariance.bottomRightCorner<3, 3>().trace()), 0.01);
  }
}

TEST_P(NoisyShapes, CylinderSlidesAlongAndTurnsAboutItsAxis) {
  Shape shape(GetParam(), 11);
  for (int i = 0; i < 120; ++i) {
    for (int k = 0; k < 60; ++k) {
      const double a = 2 * sensor::kPi * i / 120;
      const Eigen::Vector3d n(std::cos(a), std::sin(a), 0);
      shape.Add(1.0 * n + 0.05 * k * kZ, n);
    }
  }
  const OverlapGeometry g = shape.Geometry();
  EXPECT_EQ(g.constrained_directions(), 4);
  sensor::Matrix6d turn = kNothing;
  turn(2, 2) = 1e12;  // knowing the heading leaves the slide, and the other way round
  EXPECT_EQ(DescribeDirection(g.Bound(turn).weakest, 1.8).direction, "sliding along z (up-down)");
  sensor::Matrix6d slide = kNothing;
  slide(5, 5) = 1e12;
  EXPECT_EQ(DescribeDirection(g.Bound(slide).weakest, 1.8).direction, "turning about the vertical");
  EXPECT_LT(g.Bound(turn + slide).bound, 0.010);
}

TEST_P(NoisyShapes, FurnishedCornerIsFirm) {
  Shape shape(GetParam(), 13);
  shape.Rectangle({0, 0, 0}, 3 * kX, 3 * kY, kZ);
  shape.Rectangle({0, 0, 0}, 3 * kX, 2.5 * kZ, kY);
  shape.Rectangle({0, 0, 0}, 3 * kY, 2.5 * kZ, kX);
  shape.Rectangle({1, 0, 1}, 0.8 * kX, 0.5 * kY, kZ);
  const ErrorBound e = shape.Geometry().Bound(kNothing);
  EXPECT_LT(e.bound, 0.010);
  EXPECT_GT(e.strength, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Noise, NoisyShapes,
                         testing::Values(0.0, sensor::Radians(1), sensor::Radians(2)),
                         [](const auto& param) {
                           return std::to_string(std::lround(sensor::Degrees(param.param))) +
                                  "Degrees";
                         });

TEST(ErrorBound, LevellingCuresTiltAndOnlyTilt) {
  Shape shape(sensor::Radians(2),
              17);  // a floor and a wall facing x: sliding along y, nothing else open
  shape.Rectangle({0, -2, 0}, 4 * kY, 2.5 * kZ, kX);
  const sensor::Matrix6d level = LevelInformation(sensor::Radians(0.005));
  const ErrorBound without = shape.Geometry().Bound(kNothing);
  const ErrorBound with = shape.Geometry().Bound(level);
  EXPECT_LT(with.covariance(0, 0), without.covariance(0, 0) / 1e4);  // about the wall's normal
  EXPECT_GT(with.covariance(4, 4), 1.0);                             // m^2: still slides
}

TEST(ErrorBound, PoseCovarianceMovesWithTheLever) {
  const OverlapGeometry g = CorridorShape(0, 1).Geometry();
  // A pose known exactly in heading and to 5 cm in place is known to 5 cm at the centroid.
  sensor::Matrix6d covariance = sensor::Matrix6d::Identity() * 1e-12;
  covariance.bottomRightCorner<3, 3>() = 0.0025 * Eigen::Matrix3d::Identity();
  const sensor::Matrix6d information = g.FromPoseCovariance(covariance, g.centroid() + 10 * kX);
  const sensor::Matrix6d back = information.ldlt().solve(sensor::Matrix6d::Identity());
  EXPECT_NEAR(back(3, 3), 0.0025, 1e-6);
  // And 1 mrad of heading at a lever of 10 m is a centimetre.
  covariance = sensor::Matrix6d::Identity() * 1e-12;
  covariance(2, 2) = 1e-6;
  const sensor::Matrix6d turned = g.FromPoseCovariance(covariance, g.centroid() + 10 * kX)
                                      .ldlt()
                                      .solve(sensor::Matrix6d::Identity());
  EXPECT_NEAR(std::sqrt(turned(4, 4)), 0.01, 1e-4);
}

TEST(ErrorBound, RigorousBoundIsAboveTheQuantile) {
  std::mt19937_64 random(19);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int trial = 0; trial < 50; ++trial) {
    Shape shape(sensor::Radians(2), static_cast<unsigned>(trial));
    for (int face = 0; face < 4; ++face) {
      const Eigen::Vector3d n = Eigen::Vector3d(u(random), u(random), u(random)).normalized();
      const Eigen::Vector3d a = n.unitOrthogonal();
      shape.Rectangle({u(random), u(random), u(random)}, a, n.cross(a), n);
    }
    const ErrorBound e = shape.Geometry().Bound(kNothing);
    EXPECT_GE(e.rigorous, e.bound);
    EXPECT_LE(e.rigorous, 4 * e.bound);
    EXPECT_GT(e.strength, 0);
    EXPECT_LE(e.strength, 1);
  }
}

// The covariance against what happens: independent noise and errors shared by blocks, a linear
// least-squares fit each time.
TEST(ErrorBound, CovarianceIsThatOfSimulatedFits) {
  Shape shape(0, 23);
  shape.Rectangle({0, 0, 0}, 3 * kX, 2 * kY, kZ);
  shape.Rectangle({0, 0, 0}, 3 * kX, 2.5 * kZ, kY);
  shape.Rectangle({0, 0, 0}, 0.7 * kY, 2.5 * kZ, kX);
  RegistrationConfig config;
  const OverlapGeometry g(shape.points(), sensor::Radians(0.5), config);
  const ErrorBound predicted = g.Bound(kNothing);
  std::mt19937_64 random(29);
  std::normal_distribution<double> gauss;
  sensor::Matrix6d h = kNothing;
  for (const Constraint& c : shape.points()) {
    sensor::Vector6d row;
    row << (c.position - g.centroid()).cross(c.normal), c.normal;
    h += row * row.transpose();
  }
  const auto solver = h.ldlt();
  sensor::Matrix6d observed = kNothing;
  std::vector<double> moves;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::map<uint64_t, double> shared;
    sensor::Vector6d b = sensor::Vector6d::Zero();
    for (const Constraint& c : shape.points()) {
      const auto [it, fresh] =
          shared.try_emplace(CorrelationBlock(c.position, c.normal, config.correlation_length));
      if (fresh) it->second = config.correlated_sigma * gauss(random);
      sensor::Vector6d row;
      row << (c.position - g.centroid()).cross(c.normal), c.normal;
      b += row * (kShapeSigma * gauss(random) + it->second);
    }
    const sensor::Vector6d xi = solver.solve(b);
    observed += xi * xi.transpose() / kTrials;
    double move = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d x =
          g.box().corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) - g.centroid();
      move = std::max(move, (xi.head<3>().cross(x) + xi.tail<3>()).norm());
    }
    moves.push_back(move);
  }
  for (int k = 0; k < 6; ++k) {
    EXPECT_NEAR(std::sqrt(predicted.covariance(k, k) / observed(k, k)), 1.0, 0.08) << k;
  }
  std::sort(moves.begin(), moves.end());
  EXPECT_NEAR(predicted.bound / moves[kTrials * 95 / 100], 1.0, 0.12);
}

// Residuals as they are configured say nothing new; those that add up within blocks do.
TEST(ErrorBound, ResidualsWidenItOnlyBeyondWhatIsConfigured) {
  Shape shape(sensor::Radians(1), 53);
  shape.Rectangle({0, 0, 0}, 5 * kX, 4 * kY, kZ);
  shape.Rectangle({0, 0, 0}, 5 * kX, 2.5 * kZ, kY);
  shape.Rectangle({0, 0, 0}, 4 * kY, 2.5 * kZ, kX);
  shape.Rectangle({5, 0, 0}, 4 * kY, 2.5 * kZ, -kX);
  RegistrationConfig config;
  const double alone = shape.Geometry().Bound(kNothing).bound;
  const auto ratio = [&](double shared_sigma, unsigned seed, double over = 0.5) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss;
    std::map<uint64_t, double> shared;
    std::vector<Constraint> seen = shape.points();
    for (Constraint& c : seen) {
      const auto [it, fresh] = shared.try_emplace(CorrelationBlock(c.position, c.normal, over));
      if (fresh) it->second = shared_sigma * gauss(random);
      c.residual = kShapeSigma * gauss(random) + it->second;
    }
    return OverlapGeometry(seen, sensor::Radians(1), config).Bound(kNothing).bound / alone;
  };
  for (unsigned seed = 1; seed <= 10; ++seed) {
    EXPECT_NEAR(ratio(0, seed), 1.0, 0.05) << "seed " << seed;
    EXPECT_LT(ratio(config.correlated_sigma, seed), 1.35) << "seed " << seed;
    EXPECT_GE(ratio(config.correlated_sigma, seed), 0.95) << "seed " << seed;
    EXPECT_NEAR(ratio(4 * config.correlated_sigma, seed), 4.0, 1.2) << "seed " << seed;
    // Shared over four times the area, half of it is as much.
    EXPECT_NEAR(ratio(2 * config.correlated_sigma, seed, 1.0), 4.0, 2.0) << "seed " << seed;
  }
}

TEST(Words, NameAxesAndOffsets) {
  sensor::Vector6d v = sensor::Vector6d::Zero();
  v[4] = 1;
  EXPECT_EQ(DescribeDirection(v, 3).direction, "sliding along y");
  v.setZero();
  v[3] = v[4] = 1;
  EXPECT_EQ(DescribeDirection(v, 3).direction, "sliding along 45 degrees from x towards y");
  v.setZero();
  v[2] = 1;
  EXPECT_EQ(DescribeDirection(v, 3).direction, "turning about the vertical");
  v[3] = 2;  // the axis lies 2 m off
  EXPECT_EQ(DescribeDirection(v, 3).direction,
            "turning about the vertical, 2.0 m off the middle of the overlap");
  v.setZero();
  v[1] = -1;
  EXPECT_EQ(DescribeDirection(v, 3).direction, "tilting about y");
}

TEST(Config, NamesEveryFieldThatIsWrong) {
  EXPECT_TRUE(RegistrationConfig().Validate().ok());
  RegistrationConfig config;
  config.required_accuracy = std::nan("");
  config.draws = 0;
  const std::string message(config.Validate().message());
  EXPECT_NE(message.find("required_accuracy"), std::string::npos);
  EXPECT_NE(message.find("draws"), std::string::npos);
}

}  // namespace
}  // namespace vantage::registration
