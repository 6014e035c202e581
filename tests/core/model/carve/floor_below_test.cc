// The floor on which a scanner stood, in scenes where most of what it sees is another one
// (algorithm.md section 4, 'Where a scanner stood').
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::model {
namespace {

using Eigen::Vector3d;

// A hall of 10 x 10 m, with the scanner over its middle.
class FloorBelowTest : public ::testing::Test {
 protected:
  Station Scan(double viewpoint, const std::function<void(simulation::MeshBuilder&)>& build) {
    simulation::TriangleMesh mesh;
    simulation::MeshBuilder builder(mesh);
    builder.Box({-5, -5, 0}, {5, 5, 3});
    build(builder);
    sensor::Scan scan;
    scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.6);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Vector3d(0.02, -0.03, viewpoint);
    pose.rotate(Eigen::AngleAxisd(0.01, Vector3d::UnitX()));  // as tripods stand
    scan.image = simulation::SimulatedScanner(mesh).Scan(scan.scanner, pose,
                                                         simulation::ScanFaults{}, 7, pool_);
    auto model = PartialModel::Create({}).value();
    (void)model->Insert("scan", scan, pose, pool_).value();
    return model->Publish()->stations().front();
  }
  void ExpectFloorAt(const Station& station, double height) {
    ASSERT_TRUE(station.floor_found);
    EXPECT_NEAR(station.floor_height, height, 0.02);
  }

  parallel::ThreadPool pool_{2};
};

TEST_F(FloorBelowTest, APlinthCarriesTheTripodThoughMostFloorLiesLower) {
  for (const double height : {0.16, 0.3, 0.5, 0.7}) {
    for (const double half : {1.15, 1.3, 1.6}) {  // m: the blind cone ends at 0.8 to 1.05
      for (const double tripod : {1.2, 1.5}) {
        SCOPED_TRACE(testing::Message() << "plinth of " << 2 * half << " m, " << height
                                        << " m high, tripod " << tripod);
        const Station station = Scan(height + tripod, [&](simulation::MeshBuilder& builder) {
          builder.Box({-half, -half, 0}, {half, half, height});
        });
        ExpectFloorAt(station, height);
      }
    }
  }
}

TEST_F(FloorBelowTest, ALandingAtAWallCarriesTheTripod) {
  for (const double height : {0.35, 0.7}) {
    SCOPED_TRACE(height);
    const Station station = Scan(height + 1.5, [&](simulation::MeshBuilder& builder) {
      builder.Box({-5, -1.2, 0}, {1.2, 1.2, height});
      builder.Box({-5, -1.3, 0}, {5, -1.2, 3});
    });
    ExpectFloorAt(station, height);
  }
}

// What stands close on both sides comes first in most directions as well.
TEST_F(FloorBelowTest, FurnitureOnBothSidesDoesNot) {
  for (const double aisle : {0.7, 1.0, 1.6}) {
    for (const double height : {0.45, 0.75}) {
      for (const double tripod : {1.2, 1.6, 2.1}) {
        if (tripod - height < 0.6) continue;  // of the floor it sees next to nothing
        SCOPED_TRACE(testing::Message()
                     << "aisle of " << aisle << " m, " << height << " m high, tripod " << tripod);
        const auto build = [&](bool legs) {
          return [&, legs](simulation::MeshBuilder& builder) {
            for (const double side : {-1.0, 1.0}) {
              const double near = side * aisle / 2;
              const double far = side * (aisle / 2 + 1.0);
              const double bottom = legs ? height - 0.04 : 0.0;
              builder.Box({-1, std::min(near, far), bottom}, {1, std::max(near, far), height});
            }
          };
        };
        ExpectFloorAt(Scan(tripod, build(false)), 0);
        ExpectFloorAt(Scan(tripod, build(true)), 0);
      }
    }
  }
}

}  // namespace
}  // namespace vantage::model
