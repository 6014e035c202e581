// Strips of wall, posts and floors against how wide they are.
#include "core/planning/scoring/plane_extent.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

constexpr double kVoxel = 0.05;

model::PlanningView View(const std::function<bool(const Eigen::Vector3d&)>& solid) {
  test_support::ClosedFormScene scene;
  scene.extent = {Eigen::Vector3d(-1, -2, -0.2), Eigen::Vector3d(2, 2, 2.5)};
  scene.solid = solid;
  return test_support::BuildView(scene);
}

PlaneExtent ExtentAt(const model::PlanningView& model, const Eigen::Vector3d& at) {
  const std::optional<model::SurfaceVoxel> surface = model.Surface(model.At(at));
  EXPECT_TRUE(surface.has_value());
  return surface ? ExtentOfPlane(model, *surface) : PlaneExtent{};
}

// A wall that faces -x at x = 1, from `from` to `to` (m, y), 2 m high.
std::function<bool(const Eigen::Vector3d&)> Strip(double from, double to) {
  return [=](const Eigen::Vector3d& p) {
    return p.x() > 1 && p.x() < 1.1 && p.y() > from && p.y() < to && p.z() > 0 && p.z() < 2;
  };
}

TEST(PlaneExtentTest, IsAsWideAsTheStrip) {
  for (const double width : {0.3, 0.5, 0.8}) {
    const PlaneExtent extent = ExtentAt(View(Strip(0, width)), {1.025, width / 2 + 0.025, 1.025});
    EXPECT_NEAR(std::abs(extent.level.y()), 1, 0.02) << width;
    EXPECT_NEAR(std::abs(extent.upward.z()), 1, 0.02) << width;
    // The voxels at its edges have normals of either side.
    EXPECT_GE(extent.along_level, width - 2.5 * kVoxel) << width;
    EXPECT_LE(extent.along_level, width + 0.5 * kVoxel) << width;
    EXPECT_GE(extent.along_upward, 1.2f - 0.5 * kVoxel) << width << ", 0.6 m to either side";
  }
}

TEST(PlaneExtentTest, EndsWhereTheWallTurns) {
  const auto corner = [](const Eigen::Vector3d& p) {
    return (p.x() > 1 && p.x() < 1.1 && p.y() < 0.5) || (p.y() > 0.5 && p.y() < 0.6 && p.x() < 1.1);
  };
  const PlaneExtent extent = ExtentAt(View(corner), {1.025, 0.325, 1.025});
  EXPECT_NEAR(extent.along_level, 0.6 + 0.175, 2.5 * kVoxel);
}

TEST(PlaneExtentTest, OfAFloorGoesBothWays) {
  const auto floor = [](const Eigen::Vector3d& p) { return p.z() < 0; };
  const PlaneExtent extent = ExtentAt(View(floor), {0.525, 0.025, -0.025});
  EXPECT_NEAR(extent.level.z(), 0, 1e-6);
  EXPECT_NEAR(extent.upward.z(), 0, 1e-6);
  EXPECT_GT(extent.along_level, 1);
  EXPECT_GT(extent.along_upward, 1);
}

// Five samples a degree apart across a strip of a third of a metre: up to 3.8 m away when seen
// head-on, and half as far at 60 degrees.
TEST(PlaneExtentTest, IsFoundAsFarAsFiveSamplesFit) {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1);
  PlaneExtent strip;  // faces along y
  strip.along_level = 1.0f / 3;
  strip.along_upward = 2;
  const auto found = [&](double range, double incidence) {
    const Eigen::Vector3d ray(std::sin(incidence), std::cos(incidence), 0);
    return FindsPlane(strip, (range * ray).cast<float>(), scanner);
  };
  const double farthest = strip.along_level / 5 / scanner.azimuth_step;
  EXPECT_NEAR(farthest, 3.8, 0.05);
  EXPECT_TRUE(found(0.99 * farthest, 0));
  EXPECT_FALSE(found(1.01 * farthest, 0));
  EXPECT_TRUE(found(0.99 * farthest / 2, sensor::Radians(60)));
  EXPECT_FALSE(found(1.01 * farthest / 2, sensor::Radians(60)));
  strip.along_upward = 0.1f;  // a skirting board
  EXPECT_FALSE(found(0.99 * farthest, 0));
}

}  // namespace
}  // namespace vantage::planning
