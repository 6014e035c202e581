// The alignment beside PCL's point-to-plane ICP, from the same samples, centroids and start.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/align/align.h"
#include "tests/core/registration/align/pcl_icp.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

TEST(PclReference, SamePlaceMoreAccurately) {
  parallel::Serial serial;
  const BoxScene scene = FurnishedRoom(1);
  const auto model = ModelOf(scene, PoseAt({-1, -0.6, 1.4}, 0.3), {}, sensor::Radians(2), 51);
  std::mt19937_64 random(52);
  std::vector<double> ours;
  std::vector<double> pcls;
  for (unsigned t = 0; t < 7; ++t) {
    const Eigen::Isometry3d truth = PoseAt({0.9, 0.1 * t - 0.3, 1.4}, 0.8 * t);
    const ScanSurface surface = SampleSurface(ScanScene(scene, truth, {}, 60 + t), 0.05, serial);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth, 0.05, sensor::Radians(1), random);
    const Alignment a = Align(*model, surface, prior, RegistrationConfig(), serial);
    const std::span<const SurfaceSample> samples(surface.samples.data(),
                                                 std::min<size_t>(8000, surface.samples.size()));
    const Eigen::Isometry3d pcl = AlignByPcl(*model, samples, prior.T_world_scan, 0.15);
    ours.push_back((a.T_world_scan.translation() - truth.translation()).norm());
    pcls.push_back((pcl.translation() - truth.translation()).norm());
    EXPECT_LT((a.T_world_scan.translation() - pcl.translation()).norm(), 0.02) << t;
  }
  const auto median = [](std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
  };
  std::printf("median error: %.3f mm, PCL %.3f mm\n", 1000 * median(ours), 1000 * median(pcls));
  EXPECT_LT(median(ours), 0.001);
  EXPECT_LT(median(ours), median(pcls));
}

}  // namespace
}  // namespace vantage::registration
