// Sampling, alignment and verdict at three scanners, in rooms made of boxes: models made from
// scans, poses known, and bounds that follow from noise and the number of samples alone.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/runs.h"
#include "tests/support/three_scanners.h"

namespace vantage::registration {
namespace {

constexpr double kSpacing = 0.05;  // m, of samples and voxels

double RangeTo(const BoxScene& scene, const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  return scene.Cast(from, ray).range;
}

class RegistrationAtThreeScanners : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  sensor::ScannerModel Scanner() const {
    return test_support::Sector(GetParam(), sensor::Radians(130), sensor::Radians(50));
  }
  sensor::Scan ScanOf(const BoxScene& scene, const Eigen::Isometry3d& pose, uint64_t seed) const {
    return test_support::ScanBy(Scanner(), pose, seed,
                                [&](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
                                  return RangeTo(scene, from, ray);
                                });
  }
  std::shared_ptr<const model::PlanningView> ModelFrom(const BoxScene& scene,
                                                       const Eigen::Isometry3d& pose,
                                                       uint64_t seed) {
    auto model = model::PartialModel::Create(model::ModelConfig()).value();
    EXPECT_TRUE(model->Insert("first", ScanOf(scene, pose, seed), pose, serial_).ok());
    return model->Publish();
  }

  parallel::Serial serial_;
};

// The largest displacement of the room's corners.
double Moved(const BoxScene& scene, const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth) {
  double moved = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x =
        scene.room.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    moved = std::max(moved, (pose * (truth.inverse() * x) - x).norm());
  }
  return moved;
}

// How far that may be off at 95 %: one sample in each cube of 5 cm that both scans see, with the
// scanner's noise and the true surface's normal, against one sample of the other scan.
double AttainableError(const BoxScene& scene, const sensor::Scan& scan,
                       const Eigen::Isometry3d& T_world_scan,
                       const Eigen::Isometry3d& T_world_first, double noise) {
  std::map<std::tuple<int, int, int>, bool> cubes;
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  for (int c = 0; c < scan.image.columns(); c += 2) {
    for (int r = 0; r < scan.image.rows(); r += 2) {
      const Eigen::Vector3d ray = T_world_scan.linear() * scan.image.Direction(c, r);
      const BoxScene::Hit hit = scene.Cast(T_world_scan.translation(), ray);
      const Eigen::Vector3d point = T_world_scan.translation() + hit.range * ray;
      const Eigen::Array3i cube = (point / kSpacing).array().floor().cast<int>();
      if (!cubes.try_emplace({cube.x(), cube.y(), cube.z()}, true).second) continue;
      if (-hit.normal.dot(ray) < std::cos(scan.scanner.max_incidence)) continue;
      const Eigen::Vector3d to = point - T_world_first.translation();
      const Eigen::Vector3d in_first = T_world_first.linear().transpose() * to;
      const bool inside =
          std::abs(std::atan2(in_first.y(), in_first.x())) < 0.5 * scan.scanner.azimuth_span &&
          std::abs(std::asin(in_first.z() / to.norm())) < scan.scanner.elevation_max;
      const double seen = scene.Cast(T_world_first.translation(), to.normalized()).range;
      if (!inside || std::abs(seen - to.norm()) > 0.01) continue;
      sensor::Vector6d row;
      row << point.cross(hit.normal), hit.normal;
      information += row * row.transpose() / (2 * noise * noise);
    }
  }
  const sensor::Matrix6d covariance = information.ldlt().solve(sensor::Matrix6d::Identity());
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x =
        scene.room.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    Eigen::Matrix<double, 3, 6> moves;
    moves << 0, x.z(), -x.y(), 1, 0, 0, -x.z(), 0, x.x(), 0, 1, 0, x.y(), -x.x(), 0, 0, 0, 1;
    const Eigen::Matrix3d spread = moves * covariance * moves.transpose();
    largest = std::max(
        largest, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues().maxCoeff());
  }
  constexpr double kChiSquare6At95 = 12.59;
  return std::sqrt(kChiSquare6At95 * largest);
}

// The surface around a sample: one plane within a distance, or not.
struct Around {
  bool flat = false;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of what the ray meets
  double off = 0;                                    // m, of the sample from it
};
Around LookAround(const BoxScene& scene, const Eigen::Isometry3d& pose,
                  const Eigen::Vector3d& point, double within) {
  const Eigen::Vector3d to = point - pose.translation();
  const BoxScene::Hit hit = scene.Cast(pose.translation(), to.normalized());
  const Eigen::Vector3d on = pose.translation() + hit.range * to.normalized();
  Around around{true, hit.normal, hit.normal.dot(point - on)};
  const Eigen::Vector3d u = hit.normal.unitOrthogonal();
  const Eigen::Vector3d v = hit.normal.cross(u);
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * sensor::kPi * i / 16;
    const double out = i % 2 == 0 ? within : 0.5 * within;
    const Eigen::Vector3d there =
        on + out * (std::cos(angle) * u + std::sin(angle) * v) - pose.translation();
    const BoxScene::Hit beside = scene.Cast(pose.translation(), there.normalized());
    if (std::abs(beside.range - there.norm()) > 1e-6) around.flat = false;
  }
  return around;
}

TEST_P(RegistrationAtThreeScanners, SamplesLieOnTheSurfaceAndFaceAsItDoes) {
  const BoxScene scene = FurnishedRoom(1);
  const Eigen::Isometry3d pose = PoseAt({-1.6, -0.8, 1.4}, 0.2);
  const sensor::Scan scan = ScanOf(scene, pose, 21);
  const ScanSurface surface = SampleSurface(scan, kSpacing, serial_);
  // Cubes that hold returns from surface which is flat around them: each has a sample.
  std::map<std::tuple<int, int, int>, bool> cubes;
  const int stride = std::max(1, scan.image.columns() / 450);
  const auto cube_of = [](const Eigen::Vector3d& p) {
    const Eigen::Array3i cube = (p / kSpacing).array().floor().cast<int>();
    return std::tuple(cube.x(), cube.y(), cube.z());
  };
  const auto apart = [&](const Eigen::Vector3d& in_scan) {
    return std::max(0.25, 3 * in_scan.norm() * GetParam().step);
  };
  size_t flat = 0;
  size_t off = 0;
  size_t askew = 0;
  double squared = 0;
  double variance = 0;
  for (const SurfaceSample& s : surface.samples) {
    const Eigen::Vector3d in_scan = s.point.cast<double>();
    const Around around = LookAround(scene, pose, pose * in_scan, apart(in_scan));
    if (!around.flat) continue;
    ++flat;
    const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
    const double angle = std::acos(std::min(1.0, normal.dot(around.normal)));
    // Nine samples at least, as wide as a neighbourhood is: five sigma.
    const double wide = std::max(0.07, 0.8 * in_scan.norm() * GetParam().step);
    askew += angle > 5 * GetParam().noise / (3 * wide) + sensor::Radians(0.3) ? 1 : 0;
    off += std::abs(around.off) > 4 * GetParam().noise ? 1 : 0;
    squared += around.off * around.off;
    variance += static_cast<double>(s.sigma) * static_cast<double>(s.sigma);
  }
  for (int c = 0; c < scan.image.columns(); c += stride) {
    for (int r = 0; r < scan.image.rows(); r += stride) {
      const Eigen::Vector3d ray = scan.image.Direction(c, r);
      const Eigen::Vector3d in_scan = static_cast<double>(scan.image.at(c, r)) * ray;
      const Around around = LookAround(scene, pose, pose * in_scan, apart(in_scan));
      if (!around.flat || -around.normal.dot(pose.linear() * ray) < 0.4) continue;
      cubes[cube_of(in_scan)] = true;
    }
  }
  ASSERT_GT(flat, 1000u);
  EXPECT_LE(off, flat / 500);
  EXPECT_LE(askew, flat / 200);
  // The sigma that a sample comes with holds, and is not more than twice too large for one return.
  EXPECT_LE(squared, variance);
  EXPECT_LE(variance, 4 * GetParam().noise * GetParam().noise * static_cast<double>(flat));
  // Noise lies along the rays: of surface at 60 degrees half of it is across.
  EXPECT_GT(surface.roughness, 0.4 * GetParam().noise);
  EXPECT_LT(surface.roughness, 1.1 * GetParam().noise);
  EXPECT_GE(flat, cubes.size() * 90 / 100);
}

TEST_P(RegistrationAtThreeScanners, IsAsExactAsNoiseAllowsAndSaysSo) {
  constexpr std::array kRooms = {1U, 4U};
  for (const unsigned room : std::span(kRooms).first(test_support::Runs(kRooms.size()))) {
    SCOPED_TRACE(room);
    const BoxScene scene = FurnishedRoom(room);
    const Eigen::Isometry3d first = PoseAt({-1.6, -0.8, 1.4}, 0.2);
    const Eigen::Isometry3d truth = PoseAt({-1.1, 0.5, 1.5}, -0.3, 0.01, -0.015);
    const sensor::Scan scan = ScanOf(scene, truth, 31 + room);
    sensor::PosePrior prior;
    std::mt19937_64 random(17 + room);
    prior.T_world_scan = Disturbed(truth, 0.2, sensor::Radians(6), random);
    const auto model = ModelFrom(scene, first, 41 + room);
    const auto result = Register(*model, scan, prior, {}, serial_);
    ASSERT_TRUE(result.ok()) << result.status();
    const double moved = Moved(scene, result->T_world_scan, truth);
    const double attainable = AttainableError(scene, scan, truth, first, GetParam().noise);
    EXPECT_LE(moved, attainable);
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LE(moved, result->verdict.judged_bound);
    EXPECT_TRUE(result->converged);
  }
}

TEST_P(RegistrationAtThreeScanners, ACorridorIsRefusedAlongItsAxis) {
  const BoxScene scene = Corridor();
  const Eigen::Isometry3d truth = PoseAt({1.5, 0.2, 1.3}, 0.1);
  const auto model = ModelFrom(scene, PoseAt({0, 0, 1.4}, 0), 51);
  sensor::PosePrior prior;
  prior.T_world_scan = truth;
  prior.T_world_scan.translation().x() += 0.2;
  const auto result = Register(*model, ScanOf(scene, truth, 52), prior, {}, serial_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered());
  EXPECT_EQ(result->verdict.weakest_words, "sliding along x");
  // What is constrained is right all the same.
  EXPECT_NEAR(result->T_world_scan.translation().y(), 0.2, GetParam().noise);
  EXPECT_NEAR(result->T_world_scan.translation().z(), 1.3, GetParam().noise);
}

TEST_P(RegistrationAtThreeScanners, AnotherRoomIsNotAccepted) {
  const auto model = ModelFrom(FurnishedRoom(1), PoseAt({-1.6, -0.8, 1.4}, 0.2), 61);
  BoxScene other = FurnishedRoom(9);
  other.room =
      Eigen::AlignedBox3d(Eigen::Vector3d(-1.7, -3.4, -0.4), Eigen::Vector3d(4.1, 1.6, 3.3));
  sensor::PosePrior prior;
  prior.T_world_scan = PoseAt({-1.1, 0.5, 1.5}, -0.1);
  const auto result = Register(*model, ScanOf(other, prior.T_world_scan, 62), prior, {}, serial_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered()) << result->contradiction_share;
}

// The verdict on poses that somebody vouches for to 2 mm: the true one, and ones farther off.
TEST_P(RegistrationAtThreeScanners, OfTrustedPosesOnlyTheTrueOneIsRegistered) {
  const BoxScene scene = FurnishedRoom(2);
  const auto model = ModelFrom(scene, PoseAt({-1.6, -0.8, 1.4}, 0.2), 71);
  const Eigen::Isometry3d truth = PoseAt({-1.1, 0.5, 1.5}, -0.3);
  const sensor::Scan scan = ScanOf(scene, truth, 72);
  const auto verdict_at = [&](const Eigen::Isometry3d& pose) {
    sensor::PosePrior prior;
    prior.T_world_scan = pose;
    prior.trusted = true;
    prior.covariance = sensor::Matrix6d::Identity() * 4e-6;
    return Register(*model, scan, prior, {}, serial_).value().verdict;
  };
  const RegistrationVerdict at_truth = verdict_at(truth);
  EXPECT_TRUE(at_truth.registered()) << at_truth.reason;
  constexpr std::array kOff = {0.02, 0.04, 0.2};  // m
  for (const double off : std::span(kOff).first(test_support::Runs(kOff.size()))) {
    for (int axis = 0; axis < 3; axis += 2) {
      Eigen::Isometry3d wrong = truth;
      wrong.translation()[axis] += off;
      const RegistrationVerdict verdict = verdict_at(wrong);
      EXPECT_FALSE(verdict.registered())
          << off << " m along axis " << axis << ", bound " << verdict.judged_bound;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, RegistrationAtThreeScanners,
                         testing::ValuesIn(test_support::kThreeScanners));

}  // namespace
}  // namespace vantage::registration
