#include "client/simulated_job/site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "client/library/error.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {
namespace {

using ::testing::HasSubstr;

TEST(Site, GeneratedScenesStartOnFreeFloor) {
  for (const SceneKind kind : {SceneKind::kFlat, SceneKind::kTwoRooms, SceneKind::kHall,
                               SceneKind::kOffice, SceneKind::kHouse}) {
    for (const uint64_t seed : {1, 2, 3}) {
      const Site site = GeneratedSite(kind, seed, 250, std::nullopt).value();
      const simulation::SimulatedScanner tracer(site.mesh);
      EXPECT_GE(tracer.Clearance(site.start, 1.0), 0.35) << site.name;
      EXPECT_GT(site.start.z(), site.floor_height + 1.0) << site.name;
      EXPECT_LT(site.start.z(), site.floor_height + 2.0) << site.name;
    }
  }
}

TEST(Site, AnOfficeStoreyHasTheAreaAskedFor) {
  constexpr double kOutside = 1.4;  // m, what window panes and sills add, both sides together
  for (const double area : {100.0, 400.0, 900.0}) {
    const Site site = GeneratedSite(SceneKind::kOffice, 4, area, std::nullopt).value();
    const Eigen::Vector3d size = site.mesh.Bounds().sizes();
    EXPECT_GE(size.x() * size.y(), area);
    EXPECT_LE((size.x() - kOutside) * (size.y() - kOutside), area);
  }
}

TEST(Site, AStartInAWallOfAGeneratedSceneIsRefused) {
  const auto inside = GeneratedSite(SceneKind::kFlat, 1, 0, std::nullopt).value().start;
  EXPECT_EQ(GeneratedSite(SceneKind::kFlat, 1, 0, inside).value().start, inside);
  const auto refused = GeneratedSite(SceneKind::kFlat, 1, 0, Eigen::Vector3d(0.05, 0.05, 1));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(client::Explain(refused.status()).fix, HasSubstr("--start"));
}

TEST(Site, MeshWithoutStartBeginsInside) {
  const char* root = std::getenv("VANTAGE_SHARED_DATA");
  const std::string path = root == nullptr ? "" : std::string(root) + "/small_house/scene.ply";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "the small house is not on this machine (VANTAGE_SHARED_DATA)";
  }
  const auto site = MeshSite(path, std::nullopt);
  ASSERT_TRUE(site.ok()) << site.status();
  EXPECT_NEAR(site->floor_height, 0, 0.05);
  const simulation::SimulatedScanner tracer(site->mesh);
  EXPECT_GE(tracer.Clearance(site->start, 1.0), 0.35);
  // Closed house: from inside nothing is seen of the sky.
  EXPECT_FALSE(tracer.Visible(site->start, site->start + Eigen::Vector3d(0, 0, 50)));
}

TEST(Site, StartInAWallIsRefused) {
  const std::string path = ::testing::TempDir() + "/vantage_site_test.ply";
  std::ofstream(path)
      << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float "
         "y\nproperty float z\nelement face 2\nproperty list uchar int "
         "vertex_indices\nend_header\n0 0 0\n4 0 0\n0 4 0\n0 0 4\n3 0 1 2\n3 0 1 "
         "3\n";
  const auto site = MeshSite(path, Eigen::Vector3d(1, 0.05, 1));
  EXPECT_EQ(site.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(client::Explain(site.status()).fix, HasSubstr("--start"));
}

}  // namespace
}  // namespace vantage::simulated_job
