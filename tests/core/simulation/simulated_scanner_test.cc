#include "core/simulation/simulated_scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"

namespace vantage::simulation {
namespace {

sensor::ScannerModel CoarseScanner() {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1);
  return scanner;
}

Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(position);
  T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return T;
}

// Distance from a point inside the box from the origin to `size` to its faces.
double BoxRange(const Eigen::Vector3d& size, const Eigen::Vector3d& from,
                const Eigen::Vector3d& direction) {
  double range = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] > 0) range = std::min(range, (size[axis] - from[axis]) / direction[axis]);
    if (direction[axis] < 0) range = std::min(range, -from[axis] / direction[axis]);
  }
  return range;
}

const Eigen::Vector3d kRoom(6, 4, 2.7);

TEST(SimulatedScannerTest, GridFollowsTheModel) {
  const SimulatedScanner simulated(BoxRoom(kRoom).mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner;
  const sensor::RangeImage image = simulated.Scan(scanner, PoseAt({3, 2, 1.5}), {}, 1, serial);
  EXPECT_TRUE(image.Validate().ok()) << image.Validate();
  EXPECT_EQ(image.columns(), 1440);
  EXPECT_EQ(image.rows(), 600);
  EXPECT_TRUE(image.full_turn);
  EXPECT_EQ(image.native_azimuth_step, scanner.azimuth_step);
  EXPECT_NEAR(image.elevation.front(), scanner.elevation_min + 0.5 * scanner.elevation_step, 1e-12);
  EXPECT_NEAR(image.elevation.back(), scanner.elevation_max - 0.5 * scanner.elevation_step, 1e-12);
  scanner.azimuth_span = sensor::Radians(90);
  const sensor::RangeImage sector = simulated.Scan(scanner, PoseAt({3, 2, 1.5}), {}, 1, serial);
  EXPECT_FALSE(sector.full_turn);
  EXPECT_EQ(sector.columns(), 360);
  EXPECT_NEAR(sector.azimuth.front(), -sensor::Radians(45) + 0.5 * scanner.azimuth_step, 1e-12);
}

TEST(SimulatedScannerTest, RangesOfABoxAreThoseOfGeometry) {
  const SimulatedScanner simulated(BoxRoom(kRoom).mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner = CoarseScanner();
  scanner.range_min = 0.1;
  for (const double yaw : {0.0, 0.7, -2.0}) {
    const Eigen::Isometry3d pose = PoseAt({1.1, 2.6, 1.5}, yaw);
    const sensor::RangeImage image = simulated.Scan(scanner, pose, ScanFaults::None(), 1, serial);
    EXPECT_EQ(image.SampleCount(), image.cells());
    for (int column = 0; column < image.columns(); ++column) {
      for (int row = 0; row < image.rows(); ++row) {
        const Eigen::Vector3d d = pose.linear() * image.Direction(column, row);
        ASSERT_NEAR(image.at(column, row), BoxRange(kRoom, pose.translation(), d), 1e-5);
      }
    }
  }
}

TEST(SimulatedScannerTest, BeyondTheIntervalNearIsNoInformationAndFarIsNoReturn) {
  const SimulatedScanner simulated(BoxRoom({30, 4, 2.7}).mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner = CoarseScanner();
  scanner.range_min = 1.0;
  scanner.range_max = 10;
  const Eigen::Isometry3d pose = PoseAt({3, 0.8, 1.5});
  const sensor::RangeImage image = simulated.Scan(scanner, pose, ScanFaults::None(), 1, serial);
  int near = 0;
  int far = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const double truth = BoxRange({30, 4, 2.7}, pose.translation(), image.Direction(column, row));
      if (std::abs(truth - 1) < 1e-4 || std::abs(truth - 10) < 1e-4) continue;
      const float range = image.at(column, row);
      EXPECT_EQ(range == sensor::RangeImage::kNoInformation, truth < 1);
      EXPECT_EQ(range == sensor::RangeImage::kNoReturn, truth > 10);
      near += truth < 1 ? 1 : 0;
      far += truth > 10 ? 1 : 0;
    }
  }
  EXPECT_GT(near, 100);
  EXPECT_GT(far, 100);
}

TEST(SimulatedScannerTest, NoiseHasTheModelsSigma) {
  const SimulatedScanner simulated(BoxRoom(kRoom).mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner;
  scanner.range_noise = 0.003;
  scanner.range_noise_ppm = 500;
  ScanFaults faults = ScanFaults::None();
  const Eigen::Isometry3d pose = PoseAt({2, 2, 1.5});
  const sensor::RangeImage truth = simulated.Scan(scanner, pose, faults, 1, serial);
  faults.range_noise = true;
  const sensor::RangeImage noisy = simulated.Scan(scanner, pose, faults, 7, serial);
  double sum = 0;
  double squares = 0;
  double fourth = 0;
  size_t count = 0;
  for (size_t i = 0; i < truth.cells(); ++i) {
    if (!sensor::RangeImage::IsRange(truth.range[i]) ||
        !sensor::RangeImage::IsRange(noisy.range[i]))
      continue;
    const double r = truth.range[i];
    const double scaled = (noisy.range[i] - r) / (0.003 + 500e-6 * r);
    sum += scaled;
    squares += scaled * scaled;
    fourth += scaled * scaled * scaled * scaled;
    ++count;
  }
  const auto n = static_cast<double>(count);
  ASSERT_GT(n, 800'000);
  // Five sigma of each moment's own error.
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(fourth / n, 3, 5 * std::sqrt(96 / n));
}

TEST(SimulatedScannerTest, SameBytesOnAnyNumberOfThreadsAndOthersForAnotherSeed) {
  const Scene scene = FurnishedFlat(3);
  const SimulatedScanner simulated(scene.mesh);
  ScanFaults faults;
  faults.tilt = sensor::Radians(0.5);
  const Eigen::Isometry3d pose = PoseAt(scene.starts.front(), 0.3);
  const auto scan = [&](parallel::Parallel& parallel, uint64_t seed) {
    return simulated.Scan(CoarseScanner(), pose, faults, seed, parallel).range;
  };
  parallel::Serial serial;
  const std::vector<float> expected = scan(serial, 11);
  for (const int width : {2, 3, 8}) {
    parallel::ThreadPool pool(width);
    const std::vector<float> ranges = scan(pool, 11);
    ASSERT_EQ(ranges.size(), expected.size());
    EXPECT_EQ(std::memcmp(ranges.data(), expected.data(), 4 * ranges.size()), 0) << width;
  }
  EXPECT_NE(scan(serial, 12), expected);
}

// A room whose wall at x = 6 is replaced by another material.
TriangleMesh RoomWithWall(Material material) {
  TriangleMesh mesh = BoxRoom(kRoom).mesh;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    bool on_wall = true;
    for (const uint32_t v : mesh.triangles[i]) on_wall = on_wall && mesh.vertices[v].x() > 5.9f;
    if (on_wall) mesh.material[i] = material;
  }
  return mesh;
}

bool HitsWall(const Eigen::Vector3d& from, const Eigen::Vector3d& d) {
  const double range = BoxRange(kRoom, from, d);
  return std::abs((from + range * d).x() - 6) < 1e-6;
}

TEST(SimulatedScannerTest, GlassReturnsOnlyHeadOn) {
  const SimulatedScanner simulated(RoomWithWall(Material::kGlass));
  parallel::Serial serial;
  ScanFaults faults = ScanFaults::None();
  const Eigen::Vector3d from(3, 2, 1.5);
  const sensor::RangeImage all = simulated.Scan(CoarseScanner(), PoseAt(from), faults, 1, serial);
  EXPECT_EQ(all.SampleCount(), all.cells());
  faults.glass_drops_out = true;
  const sensor::RangeImage image = simulated.Scan(CoarseScanner(), PoseAt(from), faults, 1, serial);
  int head_on = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const Eigen::Vector3d d = image.Direction(column, row);
      const bool returns = !HitsWall(from, d) || d.x() > std::cos(sensor::Radians(5));
      EXPECT_EQ(sensor::RangeImage::IsRange(image.at(column, row)), returns);
      head_on += returns && HitsWall(from, d) ? 1 : 0;
    }
  }
  EXPECT_GT(head_on, 50);
}

TEST(SimulatedScannerTest, MirrorReturnsTheRoomBehindIt) {
  const SimulatedScanner simulated(RoomWithWall(Material::kMirror));
  parallel::Serial serial;
  ScanFaults faults = ScanFaults::None();
  faults.mirror_reflections = true;
  const Eigen::Vector3d from(3, 2, 1.5);
  const sensor::RangeImage image = simulated.Scan(CoarseScanner(), PoseAt(from), faults, 1, serial);
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const Eigen::Vector3d d = image.Direction(column, row);
      // Mirrored at x = 6 the room is twice as long.
      const double expected = BoxRange({12, 4, 2.7}, from, d);
      ASSERT_NEAR(image.at(column, row), expected, 1e-4);
    }
  }
}

TEST(SimulatedScannerTest, APolishedWallReflectsAtGrazingIncidenceAsOftenAsStated) {
  const SimulatedScanner simulated(RoomWithWall(Material::kPolished));
  parallel::Serial serial;
  ScanFaults faults = ScanFaults::None();
  faults.polish = 0.8;
  const Eigen::Vector3d from(5.4, 2, 1.5);  // near the wall, so that much of it is grazed
  const sensor::RangeImage image =
      simulated.Scan(sensor::ScannerModel(), PoseAt(from), faults, 3, serial);
  double expected = 0;
  double variance = 0;
  double reflected = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const Eigen::Vector3d d = image.Direction(column, row);
      if (!HitsWall(from, d) || image.at(column, row) <= 0) continue;
      const double wall = BoxRange(kRoom, from, d);
      const double incidence = sensor::Degrees(std::acos(d.x()));
      const double p = 0.8 * std::clamp((incidence - 60) / 25, 0.0, 1.0);
      expected += p;
      variance += p * (1 - p);
      if (std::abs(image.at(column, row) - wall) < 1e-4) continue;
      // Mirrored at x = 6 the room is twice as long.
      ASSERT_NEAR(image.at(column, row), BoxRange({12, 4, 2.7}, from, d), 1e-4);
      ++reflected;
    }
  }
  EXPECT_GT(expected, 1000);
  EXPECT_NEAR(reflected, expected, 5 * std::sqrt(variance));
}

TEST(SimulatedScannerTest, DarkSurfacesDropOutAsOftenAsStated) {
  const SimulatedScanner simulated(RoomWithWall(Material::kDark));
  parallel::Serial serial;
  sensor::ScannerModel scanner;
  ScanFaults faults = ScanFaults::None();
  faults.dark_dropout = 0.3;
  const Eigen::Vector3d from(3, 2, 1.5);
  const sensor::RangeImage dark = simulated.Scan(scanner, PoseAt(from), faults, 5, serial);
  double hits = 0;
  double lost = 0;
  for (int column = 0; column < dark.columns(); ++column) {
    for (int row = 0; row < dark.rows(); ++row) {
      if (!HitsWall(from, dark.Direction(column, row))) {
        EXPECT_TRUE(sensor::RangeImage::IsRange(dark.at(column, row)));
        continue;
      }
      ++hits;
      lost += sensor::RangeImage::IsRange(dark.at(column, row)) ? 0 : 1;
    }
  }
  EXPECT_NEAR(lost / hits, 0.3, 5 * std::sqrt(0.3 * 0.7 / hits));
}

TEST(SimulatedScannerTest, GrazedSurfacesDropOutAsOftenAsStated) {
  // In a long low room most of floor and ceiling is grazed.
  const Eigen::Vector3d low(30, 30, 1.0);
  const SimulatedScanner wide(BoxRoom(low).mesh);
  parallel::Serial serial;
  const sensor::ScannerModel scanner;
  ScanFaults faults = ScanFaults::None();
  faults.grazing_dropout = 0.8;
  const Eigen::Vector3d middle(15, 15, 0.5);
  const sensor::RangeImage grazed = wide.Scan(scanner, PoseAt(middle), faults, 5, serial);
  double expected = 0;
  double variance = 0;
  double dropped = 0;
  for (int column = 0; column < grazed.columns(); ++column) {
    for (int row = 0; row < grazed.rows(); ++row) {
      const Eigen::Vector3d d = grazed.Direction(column, row);
      const double range = BoxRange(low, middle, d);
      if (range > scanner.range_max - 0.01 || range < scanner.range_min + 0.01) continue;
      const bool floor_or_ceiling = std::abs((middle + range * d).z() - 0.5) > 0.5 - 1e-9;
      const double cosine = floor_or_ceiling ? std::abs(d.z()) : d.head<2>().cwiseAbs().maxCoeff();
      const double incidence = sensor::Degrees(std::acos(cosine));
      const double p = 0.8 * std::max(0.0, (incidence - 80) / 10);
      expected += p;
      variance += p * (1 - p);
      dropped += sensor::RangeImage::IsRange(grazed.at(column, row)) ? 0 : 1;
    }
  }
  EXPECT_GT(expected, 1000);
  EXPECT_NEAR(dropped, expected, 5 * std::sqrt(variance));
}

TEST(SimulatedScannerTest, MixedPixelsLieBetweenTheTwoSurfacesAndOnlyAtEdges) {
  TriangleMesh mesh = BoxRoom(kRoom).mesh;
  MeshBuilder builder(mesh);
  builder.Box({4.4, 1.7, 0}, {4.6, 2.3, 2.0});
  const SimulatedScanner simulated(mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner;
  ScanFaults faults = ScanFaults::None();
  const sensor::RangeImage clean = simulated.Scan(scanner, PoseAt({2, 2, 1.5}), faults, 1, serial);
  faults.beam_divergence = 0.0015;
  const sensor::RangeImage image = simulated.Scan(scanner, PoseAt({2, 2, 1.5}), faults, 1, serial);
  int mixed = 0;
  for (int column = 1; column + 1 < image.columns(); ++column) {
    for (int row = 1; row + 1 < image.rows(); ++row) {
      const float range = image.at(column, row);
      if (range == clean.at(column, row)) continue;
      ++mixed;
      float nearest = 100;
      float farthest = 0;
      for (int dc = -1; dc <= 1; ++dc) {
        for (int dr = -1; dr <= 1; ++dr) {
          nearest = std::min(nearest, clean.at(column + dc, row + dr));
          farthest = std::max(farthest, clean.at(column + dc, row + dr));
        }
      }
      EXPECT_GT(farthest - nearest, 0.03f);
      EXPECT_GE(range, nearest - 0.05f);
      EXPECT_LE(range, farthest + 0.05f);
    }
  }
  // The silhouette is about 180 cells up each side and 55 across; a third of a cell is beam.
  EXPECT_GT(mixed, 30);
  EXPECT_LT(mixed, 1000);
}

TEST(SimulatedScannerTest, TiltTurnsTheRoomAboutTheScanner) {
  const SimulatedScanner simulated(BoxRoom(kRoom).mesh);
  parallel::Serial serial;
  ScanFaults faults = ScanFaults::None();
  faults.tilt = sensor::Radians(1.5);
  const Eigen::Vector3d from(3, 2, 1.5);
  double roll_squares = 0;
  constexpr int kScans = 60;
  sensor::ScannerModel scanner = CoarseScanner();
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(5);
  for (uint64_t seed = 0; seed < kScans; ++seed) {
    const sensor::RangeImage image = simulated.Scan(scanner, PoseAt(from), faults, seed, serial);
    // The floor's normal in the scanner's frame says how it is tilted.
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int column = 0; column < image.columns(); ++column) {
      for (int row = 0; row < 3; ++row) {  // -57.5 to -47.5 degrees: floor
        const Eigen::Vector3d p = image.at(column, row) * image.Direction(column, row);
        products += p * p.transpose();
        sum += p;
      }
    }
    const Eigen::Vector3d plane = products.ldlt().solve(sum);
    EXPECT_NEAR(1 / plane.norm(), 1.5, 1e-3);
    const Eigen::Vector3d up = -plane.normalized();
    EXPECT_LT(std::acos(up.z()), 5 * faults.tilt);
    roll_squares += up.y() * up.y() + up.x() * up.x();
  }
  const double sigma = std::sqrt(roll_squares / (2.0 * kScans));
  EXPECT_NEAR(sigma, faults.tilt, 5 * faults.tilt / std::sqrt(4.0 * kScans));
}

}  // namespace
}  // namespace vantage::simulation
