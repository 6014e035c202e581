#include "core/simulation/tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulation {
namespace {

// Some boxes in different attitudes inside a large one.
TriangleMesh Boxes(uint64_t seed) {
  RandomSequence random(seed);
  TriangleMesh mesh;
  MeshBuilder builder(mesh);
  builder.Box({-5, -5, -5}, {5, 5, 5});
  for (int i = 0; i < 12; ++i) {
    const double x = random.Between(-4, 4);
    const double y = random.Between(-4, 4);
    const double z = random.Between(-4, 3);
    const double size = random.Between(0.2, 1.5);
    builder.TurnedBox({x, y, z}, {size, 0.5 * size, 0.8 * size}, random.Between(0, 3));
  }
  return mesh;
}

Eigen::Vector3d RandomPoint(RandomSequence& random) {
  const double x = random.Between(-4.5, 4.5);
  const double y = random.Between(-4.5, 4.5);
  return {x, y, random.Between(-4.5, 4.5)};
}

// Moeller and Trumbore, in double.
double BruteForceDistance(const TriangleMesh& mesh, const Eigen::Vector3d& origin,
                          const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[ia].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[ib].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[ic].cast<double>() - a;
    const Eigen::Vector3d p = direction.cross(ac);
    const double determinant = ab.dot(p);
    if (std::abs(determinant) < 1e-14) continue;
    const Eigen::Vector3d s = origin - a;
    const double u = s.dot(p) / determinant;
    const double v = direction.dot(s.cross(ab)) / determinant;
    const double t = ac.dot(s.cross(ab)) / determinant;
    if (u < 0 || v < 0 || u + v > 1 || t <= 0) continue;
    nearest = std::min(nearest, t);
  }
  return nearest;
}

TEST(TracerTest, RaysAgreeWithBruteForce) {
  const TriangleMesh mesh = Boxes(1);
  const Tracer tracer(mesh);
  RandomSequence random(2);
  int differing = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d from = RandomPoint(random);
    const Eigen::Vector3d to = RandomPoint(random);
    const Eigen::Vector3d d = (to - from).normalized();
    const TraceHit hit = tracer.Trace(from.cast<float>(), d.cast<float>(), 0);
    const double expected = BruteForceDistance(mesh, from, d);
    ASSERT_TRUE(hit.hit);
    // A ray along an edge may fall either way.
    differing += std::abs(hit.distance - expected) > 1e-4 * expected ? 1 : 0;
    const std::array<Eigen::Vector3f, 1> eyes = {from.cast<float>()};
    if (std::abs(expected - (to - from).norm()) > 0.01) {
      EXPECT_EQ(tracer.VisibleFrom(to.cast<float>(), eyes, 1e-4f) != 0,
                expected > (to - from).norm());
    }
  }
  EXPECT_LE(differing, 2);
}

TEST(TracerTest, PacketsAgreeWithSingleRays) {
  const Tracer tracer(Boxes(3));
  RandomSequence random(4);
  for (size_t count = 1; count <= Tracer::kPacket; ++count) {
    const Eigen::Vector3f from = RandomPoint(random).cast<float>();
    std::vector<Eigen::Vector3f> directions;
    for (size_t i = 0; i < count; ++i) {
      directions.push_back((RandomPoint(random).cast<float>() - from).normalized());
    }
    std::vector<TraceHit> hits(count);
    tracer.TracePacket(from, directions, hits);
    for (size_t i = 0; i < count; ++i) {
      const TraceHit single = tracer.Trace(from, directions[i], 0);
      EXPECT_EQ(hits[i].hit, single.hit);
      EXPECT_NEAR(hits[i].distance, single.distance, 1e-5);
    }
  }
}

TEST(TracerTest, ClearanceIsTheLimitWhereNothingIsNearer) {
  const Scene scene = BoxRoom({4, 4, 3});
  const SimulatedScanner tracer(scene.mesh);
  // None of them is a single-precision number.
  for (const double limit : {0.35, 0.1, 0.7, 1.3}) {
    EXPECT_EQ(tracer.Clearance({2, 2, 1.5}, limit), limit);
  }
}

// The nearest of points spread densely over the triangles: an upper bound, tight to the spread.
TEST(TracerTest, ClearanceAgreesWithDenselySampledSurface) {
  const TriangleMesh mesh = Boxes(5);
  const Tracer tracer(mesh);
  std::vector<Eigen::Vector3d> surface;
  constexpr int kSteps = 120;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[ia].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[ib].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[ic].cast<double>() - a;
    for (int u = 0; u <= kSteps; ++u) {
      for (int v = 0; u + v <= kSteps; ++v) {
        surface.push_back(a + ab * u / kSteps + ac * v / kSteps);
      }
    }
  }
  RandomSequence random(6);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p = RandomPoint(random);
    double nearest = 2;
    for (const Eigen::Vector3d& s : surface) nearest = std::min(nearest, (s - p).norm());
    const double clearance = tracer.Clearance(p, 2);
    EXPECT_LE(clearance, nearest + 1e-5);
    // The large box is sampled every 12 cm: half a diagonal of that at distance d.
    EXPECT_GE(std::hypot(clearance, 0.09) + 1e-5, nearest);
  }
}

TEST(TracerTest, CylinderIsFreeUntilSomethingReachesIntoIt) {
  TriangleMesh mesh;
  MeshBuilder builder(mesh);
  builder.Box({-5, -5, 0}, {5, 5, 3});
  builder.Box({1, -0.2, 0.7}, {2, 0.2, 0.75});  // a table top
  const Tracer tracer(mesh);
  EXPECT_TRUE(tracer.CylinderFree({0, 0}, 0.99, 0.05, 1.5));
  EXPECT_FALSE(tracer.CylinderFree({0, 0}, 1.01, 0.05, 1.5));
  // Below and above the table top there is space.
  EXPECT_TRUE(tracer.CylinderFree({1.5, 0}, 0.5, 0.05, 0.69));
  EXPECT_TRUE(tracer.CylinderFree({1.5, 0}, 0.5, 0.76, 1.5));
  EXPECT_FALSE(tracer.CylinderFree({1.5, 0}, 0.1, 0.05, 1.5));  // wholly inside a face
  EXPECT_FALSE(tracer.CylinderFree({4.7, 0}, 0.35, 0.05, 1.5));
  EXPECT_FALSE(tracer.CylinderFree({0, 0}, 0.5, -0.1, 1.5));  // the floor
  // The corner of the table top is 0.5 away over the diagonal.
  EXPECT_TRUE(tracer.CylinderFree({0.6, 0.5}, 0.49, 0.05, 1.5));
  EXPECT_FALSE(tracer.CylinderFree({0.6, 0.5}, 0.51, 0.05, 1.5));
}

}  // namespace
}  // namespace vantage::simulation
