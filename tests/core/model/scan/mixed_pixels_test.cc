// Beams that meet two surfaces at an edge come back from in between. With the fine steps of real
// instruments there are hundreds at each door frame, and one that is believed closes a doorway.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::model {
namespace {

constexpr double kPost = 2.0;  // m, y of its near face
constexpr double kWall = 5.0;

size_t FloatingSamples(double step, double post_width) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  builder.Box({-post_width / 2, kPost, -2}, {post_width / 2, kPost + 0.02, 2});
  builder.Box({-4, kWall, -4}, {4, kWall + 0.1, 4});
  sensor::ScannerModel scanner;
  scanner.azimuth_span = sensor::Radians(30);
  scanner.azimuth_step = scanner.elevation_step = step;
  scanner.elevation_min = -sensor::Radians(30);
  scanner.elevation_max = sensor::Radians(30);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.rotate(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  parallel::Serial serial;
  const sensor::RangeImage image =
      simulation::SimulatedScanner(mesh).Scan(scanner, pose, simulation::ScanFaults{}, 3, serial);
  const RangeSurface surface(image, scanner, sensor::Radians(8), serial);
  size_t floating = 0;
  for (int c = 0; c < surface.columns(); ++c) {
    for (int r = 0; r < surface.rows(); ++r) {
      if (!surface.Returned(c, r)) continue;
      const double y = (pose * (static_cast<double>(surface.at(c, r)) * image.Direction(c, r))).y();
      if (y > kPost + 0.05 && y < kWall - 0.03) ++floating;
    }
  }
  return floating;
}

TEST(MixedPixels, NoneIsLeftInTheAir) {
  for (const double degrees : {0.03, 0.05, 0.1, 0.25}) {
    for (const double width : {0.05, 0.3, 1.0}) {
      SCOPED_TRACE(testing::Message() << degrees << " degrees, a post of " << width << " m");
      EXPECT_LE(FloatingSamples(sensor::Radians(degrees), width), 1u);
    }
  }
}

}  // namespace
}  // namespace vantage::model
