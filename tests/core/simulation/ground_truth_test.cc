#include "core/simulation/ground_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/standable_positions.h"

namespace vantage::simulation {
namespace {

constexpr double kDensity = 2500;
const Eigen::Vector3d kTrueRoom(8, 6, 2.7);

// Area of an empty box's faces that a scanner at `from` measures at a density of at least `least`,
// by summing over 2 cm squares; the formula of algorithm.md section 3 written out again.
double BoxArea(const Eigen::Vector3d& from, double least) {
  constexpr double kStep = 0.02;
  double area = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const double plane : {0.0, kTrueRoom[axis]}) {
      for (double a = 0.5 * kStep; a < kTrueRoom[u]; a += kStep) {
        for (double b = 0.5 * kStep; b < kTrueRoom[v]; b += kStep) {
          Eigen::Vector3d p;
          p[axis] = plane;
          p[u] = a;
          p[v] = b;
          const Eigen::Vector3d way = p - from;
          const double r = way.norm();
          const double cos_i = std::abs(way[axis]) / r;
          const double e = std::asin(way.z() / r);
          if (r < 0.5 || r > 20 || cos_i < std::cos(75 * sensor::kPi / 180) || e < -sensor::kPi / 3)
            continue;
          const double step = 0.25 * sensor::kPi / 180;
          const double rho = 1 / (step * step * std::max(std::cos(e), std::sin(step)));
          if (rho * cos_i / (r * r) >= least) area += kStep * kStep;
        }
      }
    }
  }
  return area;
}

TEST(GroundTruthTest, AnEmptyBoxIsCoveredAsTheFormulaSays) {
  const Scene room = BoxRoom(kTrueRoom);
  const SimulatedScanner tracer(room.mesh);
  const std::vector<Eigen::Vector3d> positions = {{2, 2, 1.5}, {6, 4, 1.5}};
  parallel::Serial serial;
  constexpr size_t kSamples = 40'000;
  GroundTruth truth(room.mesh, tracer, sensor::ScannerModel{}, kDensity, positions, kSamples,
                    serial);
  const double total = 2 * (8 * 6 + 8 * 2.7 + 6 * 2.7);
  // Five sigma of a share of samples; stratified sampling does better.
  const double tolerance = 5 * total * 0.5 / std::sqrt(kSamples);
  EXPECT_EQ(truth.Measure().seen_area, 0);
  truth.AddScan(positions[0], serial);
  const TrueCoverage one = truth.Measure();
  EXPECT_NEAR(one.seen_area, BoxArea(positions[0], 0), tolerance);
  EXPECT_NEAR(one.at_density_area, BoxArea(positions[0], kDensity), tolerance);
  EXPECT_LE(one.seen_area, one.attainable_area);
  EXPECT_GT(one.attainable_area, one.attainable_at_density_area);
  const double gain = truth.GainAtDensity({positions[1]}, serial)[0];
  truth.AddScan(positions[1], serial);
  const TrueCoverage both = truth.Measure();
  EXPECT_DOUBLE_EQ(both.seen_area, both.attainable_area);
  EXPECT_DOUBLE_EQ(both.at_density_area, both.attainable_at_density_area);
  EXPECT_NEAR(both.at_density_area - one.at_density_area, gain, 1e-9);
  EXPECT_DOUBLE_EQ(both.seen_share(), 1);
}

TEST(GroundTruthTest, WhatNobodySeesDoesNotCount) {
  // A closed cupboard in the middle: its inside is not attainable, its faces are.
  TriangleMesh mesh = BoxRoom(kTrueRoom).mesh;
  MeshBuilder builder(mesh);
  builder.Box({3, 2, 0}, {5, 4, 2});
  builder.Box({3.1, 2.1, 0.1}, {4.9, 3.9, 1.9});  // the inside, seen from nowhere
  builder.Quad({Eigen::Vector3d(1, 0.01, 1), Eigen::Vector3d(2, 0.01, 1),
                Eigen::Vector3d(2, 0.01, 2), Eigen::Vector3d(1, 0.01, 2)},
               Material::kMirror);
  const SimulatedScanner tracer(mesh);
  parallel::Serial serial;
  std::vector<Eigen::Vector3d> positions;
  for (double x = 0.5; x < 8; x += 0.5) {
    for (double y = 0.5; y < 6; y += 0.5) {
      if (x > 2.4 && x < 5.6 && y > 1.4 && y < 4.6) continue;
      positions.emplace_back(x, y, 1.5);
    }
  }
  const GroundTruth truth(mesh, tracer, sensor::ScannerModel{}, 1, positions, 40'000, serial);
  const TrueCoverage coverage = truth.Measure();
  // Room without the square below the cupboard and the one behind the mirror; the cupboard's sides,
  // for its top is higher than the scanner. All of it is measured from somewhere.
  const double room = 2 * (8 * 6 + 8 * 2.7 + 6 * 2.7) - 4 - 1;
  const double cupboard = 4 * 2 * 2;
  EXPECT_NEAR(coverage.attainable_area, room + cupboard, 0.02 * (room + cupboard));
}

TEST(GroundTruthTest, AgreesWithBruteForceOverAllPositionsOnAnyNumberOfThreads) {
  const Scene scene = TwoRooms(1);
  const SimulatedScanner tracer(scene.mesh);
  parallel::ThreadPool pool(3);
  parallel::Serial serial;
  const std::vector<Eigen::Vector3d> positions =
      StandablePositions(tracer, scene.mesh.Bounds(), scene.starts.front(), 0, 1.5, 0.35, 0.5);
  ASSERT_GT(positions.size(), 20u);
  sensor::ScannerModel scanner;
  GroundTruth truth(scene.mesh, tracer, scanner, kDensity, positions, 4000, pool);
  // Scanning from everywhere sees exactly what is attainable.
  for (const Eigen::Vector3d& position : positions) truth.AddScan(position, serial);
  const TrueCoverage all = truth.Measure();
  EXPECT_DOUBLE_EQ(all.seen_area, all.attainable_area);
  EXPECT_DOUBLE_EQ(all.at_density_area, all.attainable_at_density_area);
  EXPECT_GT(all.attainable_area, 50);
}

TEST(GroundTruthTest, SetsAndSharesAgreeWithTheAreas) {
  const Scene room = BoxRoom(kTrueRoom);
  const SimulatedScanner tracer(room.mesh);
  const std::vector<Eigen::Vector3d> positions = {{2, 2, 1.5}, {6, 4, 1.5}, {6.5, 1, 1.2}};
  parallel::Serial serial;
  GroundTruth truth(room.mesh, tracer, sensor::ScannerModel{}, kDensity, positions, 5000, serial);
  const std::vector<SampleSet> sets = truth.MeasuredAtDensity(positions, serial);
  const std::vector<double> gains = truth.GainAtDensity(positions, serial);
  const auto area = [&](const SampleSet& set) {
    size_t count = 0;
    for (const uint64_t word : set) count += static_cast<size_t>(std::popcount(word));
    return static_cast<double>(count) * truth.area_per_sample();
  };
  for (size_t i = 0; i < positions.size(); ++i) EXPECT_NEAR(area(sets[i]), gains[i], 1e-9);
  const GroundTruth untouched = truth;
  truth.AddScan(positions[0], serial);
  EXPECT_EQ(truth.AtDensity(), sets[0]);
  EXPECT_EQ(untouched.Measure().seen_area, 0) << "a copy is a copy";
  const TrueCoverage one = truth.Measure();
  EXPECT_NEAR(one.attained_area, area(sets[0]), 1e-9);
  EXPECT_GE(one.equivalent_area, one.at_density_area);
  EXPECT_LE(one.equivalent_area, one.seen_area);
  for (const Eigen::Vector3d& position : positions) truth.AddScan(position, serial);
  EXPECT_NEAR(truth.Measure().attained_share(), 1, 1e-12);
}

TEST(StandablePositionsTest, AreTheLatticePointsClearOfTheWalls) {
  const Eigen::Vector3d size(5, 3, 2.5);
  const Scene room = BoxRoom(size);
  const SimulatedScanner tracer(room.mesh);
  const std::vector<Eigen::Vector3d> positions =
      StandablePositions(tracer, room.mesh.Bounds(), room.starts.front(), 0, 1.5, 0.35, 0.23);
  size_t expected = 0;
  for (int i = 0; 0.23 * i <= 5; ++i) {
    for (int k = 0; 0.23 * k <= 3; ++k) {
      const double x = 0.23 * i;
      const double y = 0.23 * k;
      expected += x >= 0.35 && x <= 4.65 && y >= 0.35 && y <= 2.65 ? 1 : 0;
    }
  }
  EXPECT_EQ(positions.size(), expected);
  for (const Eigen::Vector3d& p : positions) EXPECT_EQ(p.z(), 1.5);
}

TEST(StandablePositionsTest, KeepToWhatIsConnectedAndNotOnTables) {
  TriangleMesh mesh = BoxRoom(kTrueRoom).mesh;
  MeshBuilder builder(mesh);
  builder.Box({3.9, 0, 0}, {4.1, 6, 2.7});  // a wall without a door
  builder.Box({1, 2, 0.7}, {2, 4, 0.74});   // a table without legs
  const SimulatedScanner tracer(mesh);
  const std::vector<Eigen::Vector3d> positions =
      StandablePositions(tracer, mesh.Bounds(), {3, 3, 1.5}, 0, 1.5, 0.35, 0.1);
  // All of this side of the wall that is farther than the clearance from walls and table, and no
  // more; what lies within a millimetre of that may be either.
  const Eigen::AlignedBox2d side(Eigen::Vector2d(0, 0), Eigen::Vector2d(3.9, 6));
  const Eigen::AlignedBox2d table(Eigen::Vector2d(1, 2), Eigen::Vector2d(2, 4));
  size_t least = 0;
  size_t most = 0;
  for (int i = 0; i <= 39; ++i) {
    for (int k = 0; k <= 60; ++k) {
      const Eigen::Vector2d at(0.1 * i, 0.1 * k);
      const double to_walls = std::min((at - side.min()).minCoeff(), (side.max() - at).minCoeff());
      const double free = std::min(to_walls, table.exteriorDistance(at)) - 0.35;
      least += free > 0.001 ? 1 : 0;
      most += free > -0.001 ? 1 : 0;
    }
  }
  EXPECT_GE(positions.size(), least);
  EXPECT_LE(positions.size(), most);
  for (const Eigen::Vector3d& p : positions) {
    EXPECT_LT(p.x(), 3.9 - 0.349);
    EXPECT_GT(table.exteriorDistance(Eigen::Vector2d(p.head<2>())), 0.349) << p.transpose();
  }
}

}  // namespace
}  // namespace vantage::simulation
