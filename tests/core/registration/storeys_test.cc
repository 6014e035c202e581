// Buildings of several storeys, and scans of which only the tilt is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/registration/align/scanner_heights.h"
#include "core/registration/global_registration.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

constexpr double kRise = 3.1;  // m, from floor to floor
const Eigen::Isometry3d kFirst = PoseAt({-1, -0.6, 1.4}, 0.3);
const Eigen::Isometry3d kSecond = PoseAt({1.1, 0.2, 1.5}, 1.0);

struct Storey {
  BoxScene scene;  // floor at z = 0
  bool twice = false;
};

Eigen::Isometry3d On(size_t storey, Eigen::Isometry3d pose) {
  pose.pretranslate(Eigen::Vector3d(0, 0, kRise * static_cast<double>(storey)));
  return pose;
}

// As seen from one station on each storey, or two.
std::shared_ptr<const model::PlanningView> Scanned(const std::vector<Storey>& storeys) {
  parallel::ThreadPool pool(2);
  const auto partial = model::PartialModel::Create({}).value();
  unsigned seed = 0;
  for (size_t k = 0; k < storeys.size(); ++k) {
    for (const Eigen::Isometry3d& pose : {kFirst, kSecond}) {
      if (pose.matrix() == kSecond.matrix() && !storeys[k].twice) continue;
      ++seed;
      partial
          ->Insert(std::to_string(seed), ScanScene(storeys[k].scene, pose, {}, seed), On(k, pose),
                   pool)
          .value();
    }
  }
  return partial->Publish();
}

BoxScene Wider(BoxScene scene, double by) {
  scene.room.extend(Eigen::Vector3d(scene.room.max() + Eigen::Vector3d(by, by, 0)));
  return scene;
}

double Away(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

// The three largest floors are those of other storeys.
TEST(Storeys, TheFourthOfFiveIsFound) {
  parallel::ThreadPool pool(2);
  const std::vector<Storey> storeys = {{Wider(FurnishedRoom(1), 0.8), true},
                                       {Wider(FurnishedRoom(2), 1.2), true},
                                       {Wider(FurnishedRoom(3), 1.6), true},
                                       {FurnishedRoom(4)},
                                       {Wider(FurnishedRoom(5), 2.0), true}};
  const auto model = Scanned(storeys);
  const Eigen::Isometry3d truth = On(3, PoseAt({0.6, -0.3, 1.5}, 2.0));
  const sensor::Scan scan = ScanScene(storeys[3].scene, PoseAt({0.6, -0.3, 1.5}, 2.0), {}, 77);
  const auto result = RegisterGlobally(*model, scan, On(4, kSecond), {}, pool);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
  EXPECT_LT(Away(result->T_world_scan, truth), 0.005);
}

// The ground floor looks like the fourth storey but for a small thing, and has the larger floor.
TEST(Storeys, AStoreyThatLooksLikeAnotherIsNotTakenForIt) {
  parallel::ThreadPool pool(2);
  BoxScene fourth = FurnishedRoom(4);
  fourth.solids.emplace_back(Eigen::Vector3d(-2.9, 1.6, 0), Eigen::Vector3d(-2.6, 1.9, 0.9));
  const std::vector<Storey> storeys = {{FurnishedRoom(4), true},
                                       {Wider(FurnishedRoom(2), 1.2), true},
                                       {Wider(FurnishedRoom(3), 1.6), true},
                                       {fourth},
                                       {FurnishedRoom(5)}};
  const auto model = Scanned(storeys);
  for (const double heading : {2.0, -1.0}) {
    const Eigen::Isometry3d pose = PoseAt({0.6, -0.3, 1.5}, heading);
    const Eigen::Isometry3d truth = On(3, pose);
    const sensor::Scan scan = ScanScene(fourth, pose, {}, 78);
    const auto result = RegisterGlobally(*model, scan, On(4, kFirst), {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    double nearest = Away(result->T_world_scan, truth);
    if (!result->verdict.registered()) {
      for (const RivalPose& rival : result->rival_poses) {
        nearest = std::min(nearest, Away(rival.T_world_scan, truth));
      }
    }
    EXPECT_LT(nearest, 0.01) << result->verdict.reason;
    EXPECT_LT(Away(result->T_world_scan, truth), std::max(0.01, result->verdict.error_bound));
  }
}

TEST(Storeys, AllFloorsAreKnownAndFurnitureIsNone) {
  const std::vector<Storey> storeys = {{FurnishedRoom(1)},
                                       {Wider(FurnishedRoom(2), 1.0), true},
                                       {FurnishedRoom(3), true},
                                       {FurnishedRoom(4)},
                                       {FurnishedRoom(5), true}};
  const auto model = Scanned(storeys);
  FloorPlane floor;
  floor.height = -1.5;
  std::vector<double> heights;
  for (const ScannerHeight& height : ScannerHeights(*model, &floor)) {
    heights.push_back(height.z());
    EXPECT_TRUE(height.FloorNear({0, 0}));
    EXPECT_FALSE(height.FloorNear({12, 0}));
  }
  ASSERT_EQ(heights.size(), storeys.size());
  EXPECT_NEAR(heights.front(), kRise + 1.5, 0.02) << "the largest first";
  std::sort(heights.begin(), heights.end());
  for (size_t k = 0; k < heights.size(); ++k) {
    EXPECT_NEAR(heights[k], kRise * static_cast<double>(k) + 1.5, 0.02);
  }
}

// A platform that reaches from wall to wall is a floor, a table is none.
TEST(Storeys, APlatformIsAFloorWhereItIs) {
  BoxScene hall = BareRoom();
  hall.room = Eigen::AlignedBox3d(Eigen::Vector3d(-4, -2.5, 0), Eigen::Vector3d(14, 2.5, 3.5));
  hall.solids.emplace_back(Eigen::Vector3d(10, -2.5, 0), Eigen::Vector3d(14, 2.5, 0.6));
  hall.solids.emplace_back(Eigen::Vector3d(-3, -2.2, 0.7), Eigen::Vector3d(0, -0.9, 0.74));
  parallel::ThreadPool pool(2);
  const auto partial = model::PartialModel::Create({}).value();
  unsigned seed = 0;
  for (const Eigen::Isometry3d& pose : {PoseAt({-2, 1, 1.5}, 0), PoseAt({11.5, 0.5, 2.1}, 1)}) {
    ++seed;
    partial->Insert(std::to_string(seed), ScanScene(hall, pose, {}, seed), pose, pool).value();
  }
  FloorPlane floor;
  floor.height = -1.5;
  const std::vector<ScannerHeight> heights = ScannerHeights(*partial->Publish(), &floor);
  ASSERT_EQ(heights.size(), 2U);
  const auto at = [&](double x) {
    std::vector<double> z;
    for (const size_t k : HeightsAt(heights, {x, 0})) z.push_back(heights[k].z());
    std::sort(z.begin(), z.end());
    return z;
  };
  ASSERT_EQ(at(-3).size(), 1U);
  EXPECT_NEAR(at(-3)[0], 1.5, 0.02);
  ASSERT_FALSE(at(13.5).empty());
  EXPECT_NEAR(at(13.5).back(), 2.1, 0.02);
  EXPECT_EQ(at(100).size(), 2U) << "where no floor is known, all";
}

}  // namespace
}  // namespace vantage::registration
