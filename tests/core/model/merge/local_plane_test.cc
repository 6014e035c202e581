// Surface voxels of a room in closed form, at three scanners: they lie on it and face as it does,
// also along its edges.
#include "core/model/merge/local_plane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

struct VoxelCase {
  test_support::ScannerCase scanner;
  double voxel;  // m
};
void PrintTo(const VoxelCase& of, std::ostream* out) {
  *out << of.scanner.name << ", voxels of " << of.voxel << " m";
}

class SurfaceVoxelsTest : public testing::TestWithParam<VoxelCase> {
 protected:
  // The faces that a point is on or near, and how near the two nearest are.
  struct Faces {
    double nearest = 10;  // m
    double second = 10;   // m
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d second_normal = Eigen::Vector3d::Zero();
  };
  // Of the room, seen from inside, and of the box in it, from outside.
  Faces FacesNear(const Eigen::Vector3d& point) const {
    Faces faces;
    const auto add = [&](double off, const Eigen::Vector3d& normal) {
      if (off < faces.nearest) {
        faces.second = faces.nearest;
        faces.second_normal = faces.normal;
        faces.nearest = off;
        faces.normal = normal;
      } else if (off < faces.second) {
        faces.second = off;
        faces.second_normal = normal;
      }
    };
    const auto sides = [&](const Eigen::AlignedBox3d& box, double sign) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const bool high : {false, true}) {
          const double plane = high ? box.max()[axis] : box.min()[axis];
          Eigen::Vector3d on = point.cwiseMax(box.min()).cwiseMin(box.max());
          on[axis] = plane;
          add((point - on).norm(), sign * (high ? 1.0 : -1.0) * Eigen::Vector3d::Unit(axis));
        }
      }
    };
    sides(scene_.air[0], -1);
    const TurnedBox& solid = scene_.solids[0];
    sides({solid.centre - solid.half, solid.centre + solid.half}, 1);
    return faces;
  }

  void Scan() {
    const sensor::ScannerModel scanner =
        test_support::Sector(GetParam().scanner, sensor::Radians(120), sensor::Radians(60));
    const Eigen::Isometry3d pose = PoseAt({-1.3, -0.9, 1.4}, 0.6);
    const sensor::Scan scan = test_support::ScanBy(
        scanner, pose, 11, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
          return scene_.Cast(from, ray, 30);
        });
    ModelConfig config;
    config.voxel_size = GetParam().voxel;
    auto model = PartialModel::Create(config).value();
    ASSERT_TRUE(model->Insert("scan", scan, pose, serial_).ok());
    view_ = model->Publish();
  }

  parallel::Serial serial_;
  ClosedFormScene scene_ = BoxInRoom();
  std::shared_ptr<const PlanningView> view_;
};

TEST_P(SurfaceVoxelsTest, LieOnTheSurfaceAndFaceAsItDoes) {
  Scan();
  const double away = 2.2 * GetParam().voxel;  // m from an edge: beyond the voxels around
  size_t flat = 0;
  size_t off = 0;
  size_t askew = 0;
  view_->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& voxel) {
    if (state != VoxelState::kTrueSurface || voxel.samples == 0) return;
    const Faces faces = FacesNear(voxel.centroid.cast<double>());
    if (faces.second < away) return;
    ++flat;
    const double sigma = GetParam().scanner.noise / std::sqrt(static_cast<double>(voxel.samples));
    off += faces.nearest > 5 * sigma + 1e-4 ? 1 : 0;
    // A patch of three voxels, held by at least as many samples as the voxel has: five sigma.
    const double turned = 5 * sigma / GetParam().voxel + sensor::Radians(3);
    askew += voxel.normal.cast<double>().dot(faces.normal) < std::cos(turned) ? 1 : 0;
  });
  ASSERT_GT(flat, 1500u);
  EXPECT_LE(off, flat / 200);
  EXPECT_LE(askew, flat / 100);
}

// A fit across an edge is neither of the two surfaces.
TEST_P(SurfaceVoxelsTest, AtEdgesFaceAsOneOfTheTwoSurfaces) {
  Scan();
  size_t edge = 0;
  size_t neither = 0;
  view_->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& voxel) {
    if (state != VoxelState::kTrueSurface || voxel.samples == 0) return;
    const Faces faces = FacesNear(voxel.centroid.cast<double>());
    if (faces.second > GetParam().voxel) return;
    ++edge;
    const Eigen::Vector3d normal = voxel.normal.cast<double>();
    const double like = std::max(normal.dot(faces.normal), normal.dot(faces.second_normal));
    neither += like < std::cos(sensor::Radians(20)) ? 1 : 0;
  });
  ASSERT_GT(edge, 60u);
  EXPECT_LE(neither, edge / 10);
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, SurfaceVoxelsTest,
                         testing::Values(VoxelCase{test_support::kThreeScanners[0], 0.05},
                                         VoxelCase{test_support::kThreeScanners[1], 0.05},
                                         VoxelCase{test_support::kThreeScanners[2], 0.05},
                                         VoxelCase{test_support::kThreeScanners[1], 0.02}));

}  // namespace
}  // namespace vantage::model
