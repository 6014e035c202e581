// Offsets from walls, against the scene itself: a tape that is held as they say ends at a wall.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/ranking/rank_views.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/runs.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;

TEST(Location, TapesEndAtWalls) {
  parallel::ThreadPool pool(2);
  std::mt19937_64 random(11);
  size_t walls = 0;
  const int flats = test_support::Runs(3);
  for (int seed = 0; seed < flats; ++seed) {
    const simulation::Scene flat = simulation::FurnishedFlat(static_cast<uint64_t>(60 + seed));
    const simulation::SimulatedScanner tracer(flat.mesh);
    sensor::Scan scan;
    scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.5);
    const auto model = model::PartialModel::Create({}).value();
    for (size_t i = 0; i < std::min<size_t>(2, flat.starts.size()); ++i) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translate(flat.starts[i]);
      scan.image = tracer.Scan(scan.scanner, pose, {}, i + 1, pool);
      ASSERT_TRUE(model->Insert(std::to_string(i), scan, pose, pool).ok());
    }
    const auto view = model->Publish();
    const auto problem = PlanningProblem::Prepare({*view, scan.scanner, {}}, pool).value();
    const size_t count = problem->feasible().cells().size();
    ASSERT_GT(count, 0u);
    for (int k = 0; k < 60; ++k) {
      RankedView at;
      const auto i = static_cast<uint32_t>(random() % count);
      at.position = problem->feasible().Centre(i);
      for (const WallOffset& wall : DescribeLocation(*problem, at).walls) {
        ++walls;
        // Planes are three voxels apart at most, and to 0.95 of each other; edges are known to a
        // voxel or two, so a tape may have to be held that much to a side.
        double off = 1e9;
        for (const double aside : {-0.1, 0.0, 0.1}) {
          for (const double up : {-0.1, 0.0, 0.1}) {
            const Vector3d from = at.position + aside * wall.wall_normal.cross(Vector3d::UnitZ()) +
                                  up * Vector3d::UnitZ();
            const auto hit = tracer.tracer().Trace(from.cast<float>(),
                                                   Vector3d(-wall.wall_normal).cast<float>(), 0);
            if (hit.hit) off = std::min(off, std::abs(double{hit.distance} - wall.distance));
          }
        }
        EXPECT_LT(off, 0.2 + 0.05 * wall.distance)
            << "flat " << seed << ", at " << at.position.transpose() << ", wall towards "
            << -wall.wall_normal.transpose();
      }
    }
  }
  EXPECT_GT(walls, 30u * static_cast<size_t>(flats));
}

}  // namespace
}  // namespace vantage::planning
