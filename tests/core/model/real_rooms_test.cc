// The two real scans: sparse (6 cm between samples at 3 m), quantised to 1 cm, tilted, irregular
// columns. Their surfaces are closed between the samples, and nothing leaks.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/scan_file.h"

namespace vantage::model {
namespace {

class RealRoomsTest : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("VANTAGE_SHARED_DATA");
    const std::string folder = std::string(data == nullptr ? "" : data) + "/pcl_room_scan";
    std::ifstream poses(folder + "/poses.txt");
    if (!poses) GTEST_SKIP() << folder << " is not here: no real scans to read";
    model_ = PartialModel::Create({}).value();
    parallel::ThreadPool pool(2);
    for (std::string line; std::getline(poses, line);) {
      std::istringstream words(line);
      std::string name;
      if (!(words >> name) || name[0] == '#') continue;
      Eigen::Matrix4d matrix;
      for (int i = 0; i < 16; ++i) words >> matrix(i / 4, i % 4);
      ASSERT_TRUE(words) << line;
      Eigen::Isometry3d pose(matrix);
      pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
      const auto scan = sensor::ReadScanFile(folder + "/" + name + ".ptx", {});
      ASSERT_TRUE(scan.ok()) << scan.status();
      images_.push_back(scan->image);
      poses_.push_back(pose);
      ASSERT_TRUE(
          model_->Insert(name, {scan->image, scan->scanner, std::nullopt}, pose, pool).ok());
    }
    ASSERT_EQ(images_.size(), 2u);
    view_ = model_->Publish();
  }

  // Calls fn(samples, their ranges) for every four samples around a cell's upper right corner: own,
  // right, upper right, upper; m, model frame.
  template <typename Fn>
  void ForEachFour(Fn&& fn) const {
    constexpr std::array<std::array<int, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (size_t i = 0; i < images_.size(); ++i) {
      const sensor::RangeImage& image = images_[i];
      for (int c = 0; c + 1 < image.columns(); ++c) {
        for (int r = 0; r + 1 < image.rows(); ++r) {
          std::array<Eigen::Vector3d, 4> point;
          std::array<double, 4> range;
          bool all = true;
          for (size_t k = 0; k < 4; ++k) {
            const int column = c + kCorners[k][0];
            const int row = r + kCorners[k][1];
            range[k] = static_cast<double>(image.at(column, row));
            all = all && range[k] > 0;
            point[k] = poses_[i] * (range[k] * image.Direction(column, row));
          }
          if (all) fn(point, range);
        }
      }
    }
  }

  bool Opaque(const Eigen::Vector3d& point) const {
    const VoxelState state = view_->State(view_->At(point));
    return state == VoxelState::kTrueSurface || state == VoxelState::kAbsorbed;
  }

  std::unique_ptr<PartialModel> model_;
  std::vector<sensor::RangeImage> images_;
  std::vector<Eigen::Isometry3d> poses_;
  std::shared_ptr<const PlanningView> view_;
};

TEST_F(RealRoomsTest, SurfacesAreClosedBetweenSamplesAndOpenAtEdges) {
  size_t smooth = 0;
  size_t gaps = 0;
  size_t edges = 0;
  size_t bridged = 0;
  ForEachFour([&](const std::array<Eigen::Vector3d, 4>& p, const std::array<double, 4>& range) {
    const auto [least, most] = std::minmax_element(range.begin(), range.end());
    if (*most - *least < 0.04 && (p[2] - p[0]).norm() < 0.2) {
      // The same wall: every place between is surface.
      constexpr std::array<double, 3> kShares = {0.25, 0.5, 0.75};
      for (size_t k = 0; k < 9; ++k) {
        const double u = kShares[k % 3];
        const double v = kShares[k / 3];
        const Eigen::Vector3d low = (1 - u) * p[0] + u * p[1];
        const Eigen::Vector3d high = (1 - u) * p[3] + u * p[2];
        ++smooth;
        gaps += Opaque((1 - v) * low + v * high) ? 0 : 1;
      }
    }
    if (std::abs(range[0] - range[1]) > 0.8) {
      // One behind the other: in the middle of the gap there is nothing.
      ++edges;
      bridged += Opaque(0.5 * (p[0] + p[1])) ? 1 : 0;
    }
  });
  std::printf("%zu places between samples, %zu gaps; %zu edges, %zu bridged\n", smooth, gaps, edges,
              bridged);
  ASSERT_GT(smooth, 30'000u);
  EXPECT_LE(gaps, smooth / 1000);
  ASSERT_GT(edges, 500u);
  // A line across a gap may pass through other measured surface.
  EXPECT_LE(bridged, edges / 20);
}

TEST_F(RealRoomsTest, NothingLeaks) {
  const VoxelBox box = view_->bounds();
  const std::vector<VoxelIndex> faces = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                         {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  size_t empty = 0;
  size_t leaks = 0;
  for (int z = box.min.z(); z < box.max.z(); ++z) {
    for (int y = box.min.y(); y < box.max.y(); ++y) {
      for (int x = box.min.x(); x < box.max.x(); ++x) {
        const VoxelIndex v(x, y, z);
        if (!view_->Empty(v)) continue;
        ++empty;
        for (const VoxelIndex& face : faces) {
          leaks += view_->State(v + face) == VoxelState::kUnknown ? 1 : 0;
        }
      }
    }
  }
  ASSERT_GT(empty, 300'000u);
  EXPECT_EQ(leaks, 0u);
}

}  // namespace
}  // namespace vantage::model
