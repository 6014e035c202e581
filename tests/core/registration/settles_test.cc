// An alignment from a prior that is nearly right settles, in any scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/registration/registration.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

constexpr double kOff = 0.004;  // m, that priors are off

class SettlesTest : public testing::Test {
 protected:
  // Registers `scan`, which was made at `truth`, from priors that say how good they are, and that
  // do not.
  void Register4mmOff(const model::PlanningView& model, const sensor::Scan& scan,
                      const Eigen::Isometry3d& truth) {
    for (const bool stated : {false, true}) {
      sensor::PosePrior prior;
      prior.T_world_scan = Disturbed(truth, kOff, 0.001, random_);
      if (stated) {
        prior.covariance =
            sensor::Vector6d{{0.001, 0.001, 0.001, kOff, kOff, kOff}}.cwiseAbs2().asDiagonal();
      }
      const auto result = Register(model, scan, prior, {}, pool_);
      ASSERT_TRUE(result.ok()) << result.status();
      ++made_;
      EXPECT_TRUE(result->converged) << result->verdict.reason;
      EXPECT_LE(result->iterations, 100);
      most_ = std::max(most_, result->iterations);
    }
  }
  void InScene(const simulation::Scene& scene, uint64_t seed) {
    const simulation::SimulatedScanner simulated(scene.mesh);
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
    const auto scan_at = [&](const Eigen::Isometry3d& pose, uint64_t noise) {
      return sensor::Scan{simulated.Scan(scanner, pose, {}, noise, pool_), scanner, {}};
    };
    const Eigen::Vector3d first = scene.starts[0];
    const Eigen::Isometry3d T_first = PoseAt(first, 0.3);
    const auto partial = model::PartialModel::Create({}).value();
    partial->Insert("first", scan_at(T_first, seed), T_first, pool_).value();
    const auto model = partial->Publish();
    std::uniform_real_distribution<double> away(-3, 3);
    int scans = 0;
    for (int tries = 0; scans < 3 && tries < 1000; ++tries) {
      const Eigen::Vector3d at = first + Eigen::Vector3d(away(random_), away(random_), 0);
      if (simulated.Clearance(at, 0.3) < 0.3 || !simulated.Visible(first, at)) continue;
      const Eigen::Isometry3d truth = PoseAt(at, away(random_), 0.01, -0.01);
      ++scans;
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", scan " << scans);
      Register4mmOff(*model, scan_at(truth, 100 * seed + static_cast<uint64_t>(scans)), truth);
    }
  }

  parallel::ThreadPool pool_{2};
  std::mt19937_64 random_{5};
  int made_ = 0;
  int most_ = 0;  // steps
};

TEST_F(SettlesTest, InFlatsOfficesAndHalls) {
  for (uint64_t seed = 1; seed <= test_support::Runs(2U); ++seed) {
    InScene(simulation::FurnishedFlat(seed), seed);
    InScene(simulation::OfficeStorey(seed, 150), seed);
    InScene(simulation::PillarHall(seed), seed);
  }
  EXPECT_GE(made_, test_support::Runs(2) * 3 * 4);
  std::printf("%d alignments, at most %d steps\n", made_, most_);
}

// Directions that nothing holds are where steps go on.
TEST_F(SettlesTest, InRoomsAndCorridorsThatHoldLittle) {
  std::vector<BoxScene> scenes = {BareRoom(), Corridor(), FurnishedRoom(1), FurnishedRoom(2)};
  BoxScene pilasters = Corridor();
  for (const double x : {-9.1, -6.4, -3.2, 0.6, 2.9, 6.8}) {
    pilasters.solids.emplace_back(Eigen::Vector3d(x, -1, 0), Eigen::Vector3d(x + 0.5, -0.9, 2.5));
  }
  scenes.push_back(std::move(pilasters));
  unsigned seed = 0;
  for (const BoxScene& scene : scenes) {
    const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, ++seed);
    for (unsigned k = 0; k < test_support::Runs(2U); ++k) {
      SCOPED_TRACE(testing::Message() << "scene " << seed << ", scan " << k);
      const Eigen::Isometry3d truth = PoseAt({0.9 * k - 0.6, 0.1, 1.4}, 0.8 * k, 0.01 * k, -0.01);
      Register4mmOff(*model, ScanScene(scene, truth, {}, 100 * seed + k), truth);
    }
  }
  std::printf("%d alignments, at most %d steps\n", made_, most_);
}

}  // namespace
}  // namespace vantage::registration
