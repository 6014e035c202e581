// What comes and goes between scans.
#include "core/simulation/scenes/passing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {
namespace {

TEST(PassingTest, APersonHasTheSizeOfOneAndStandsWherePut) {
  TriangleMesh mesh;
  MeshBuilder builder(mesh);
  AddPerson({2, 1, 0}, 0.7, builder);
  const Eigen::AlignedBox3d bounds = mesh.Bounds();
  EXPECT_NEAR(bounds.min().z(), 0, 1e-6);
  EXPECT_NEAR(bounds.max().z(), 1.75, 1e-6);
  EXPECT_NEAR(bounds.center().x(), 2, 0.05);
  EXPECT_NEAR(bounds.center().y(), 1, 0.05);
  EXPECT_LT(bounds.sizes().head<2>().norm(), 0.85);
}

TEST(PassingTest, ADoorTurnsAboutItsHinge) {
  const DoorLeaf leaf{{1, 1, 0}, 0.9, 1.98, 0};
  for (const double angle : {0.0, 0.5, 1.5}) {
    TriangleMesh mesh;
    MeshBuilder builder(mesh);
    AddDoorLeaf(leaf, angle, builder);
    double farthest = 0;
    for (const Eigen::Vector3f& v : mesh.vertices) {
      farthest = std::max(farthest, (v.cast<double>() - leaf.hinge).head<2>().norm());
    }
    EXPECT_NEAR(farthest, 0.9, 0.001);
    const Eigen::Vector3d tip = leaf.hinge +
                                0.45 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0) +
                                Eigen::Vector3d(0, 0, 1);
    EXPECT_LT(SimulatedScanner(mesh).Clearance(tip, 1), 0.021);
  }
}

TEST(PassingTest, TheOperatorStandsFreeInSightAndElsewhereEachTime) {
  const Scene scene = PaneRoom({});
  const SimulatedScanner tracer(scene.mesh);
  const Eigen::Vector3d scanner = scene.starts[0];
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const auto place = OperatorPlace(tracer, scanner, 0, seed);
    ASSERT_TRUE(place.has_value()) << seed;
    EXPECT_EQ(*place, *OperatorPlace(tracer, scanner, 0, seed));
    EXPECT_NE(*place, last);
    last = *place;
    const double distance = (*place - scanner).head<2>().norm();
    EXPECT_GE(distance, 1.2);
    EXPECT_LE(distance, 2.5);
    EXPECT_TRUE(tracer.Visible(scanner, *place + Eigen::Vector3d(0, 0, 1.2)));
    EXPECT_GE(tracer.Clearance(*place + Eigen::Vector3d(0, 0, 1.0), 1), 0.29);
  }
}

}  // namespace
}  // namespace vantage::simulation
