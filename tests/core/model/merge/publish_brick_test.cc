// Centroids, normals, areas and recorded densities against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/model/partial_model.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

double Percentile95(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() * 95 / 100];
}

// Plane of the room's far wall and of the scene's tilted boards, with the side that is seen.
struct Plane {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
};

class PublishBrickTest : public testing::Test {
 protected:
  static constexpr double kNoise = 0.003;
  static constexpr double kVoxel = 0.05;

  void Build(const ClosedFormScene& scene) {
    scene_ = scene;
    pose_ = PoseAt(scene.stations[0], 0.2, 0.01, 0.02);
    options_.noise = kNoise;
    scan_ = ScanScene(scene, pose_, options_);
    parallel::Serial serial;
    model_ = PartialModel::Create({}).value();
    ASSERT_TRUE(model_->Insert("a", scan_, pose_, serial).ok());
    view_ = model_->Publish();
  }

  // Voxels on a plane, at least `margin` from every other surface: found from the scene alone.
  template <typename Fn>
  void OnPlane(const Plane& plane, double half_u, double half_v, Fn&& fn) const {
    const Eigen::Vector3d u = plane.normal.unitOrthogonal();
    const Eigen::Vector3d v = plane.normal.cross(u);
    view_->ForEachSurface([&](const VoxelIndex& index, VoxelState state, const SurfaceVoxel& s) {
      if (state != VoxelState::kTrueSurface) return;
      const Eigen::Vector3d off = view_->Centre(index) - plane.point;
      if (std::abs(off.dot(plane.normal)) > kVoxel) return;
      if (std::abs(off.dot(u)) > half_u || std::abs(off.dot(v)) > half_v) return;
      fn(s);
    });
  }

  ClosedFormScene scene_;
  ScanOptions options_;
  Eigen::Isometry3d pose_;
  sensor::Scan scan_;
  std::unique_ptr<PartialModel> model_;
  std::shared_ptr<const PlanningView> view_;
};

TEST_F(PublishBrickTest, NormalsAndCentroidsOfWalls) {
  Build(EmptyRoom());
  const Eigen::AlignedBox3d room = scene_.air[0];
  const std::vector<Plane> planes = {
      {{room.max().x(), 0, 1.3}, {-1, 0, 0}},
      {{0, room.min().y(), 1.3}, {0, 1, 0}},
      {{1.2, -0.9, room.max().z()}, {0, 0, -1}},
  };
  for (const Plane& plane : planes) {
    std::vector<double> angles;
    std::vector<double> offsets;  // in units of sigma / sqrt(n)
    OnPlane(plane, 0.8, 0.8, [&](const SurfaceVoxel& s) {
      angles.push_back(sensor::Degrees(
          std::acos(std::clamp(s.normal.cast<double>().dot(plane.normal), -1.0, 1.0))));
      if (s.samples < 4) return;
      const double off = (s.centroid.cast<double>() - plane.point).dot(plane.normal);
      offsets.push_back(std::abs(off) / (kNoise / std::sqrt(static_cast<double>(s.samples))));
    });
    ASSERT_GT(angles.size(), 800u);
    EXPECT_LE(Percentile95(angles), 3.0);
    ASSERT_GT(offsets.size(), 500u);
    // rms of at most 1.2 sigma / sqrt(n): its 95th percentile lies at 1.96 of that.
    EXPECT_LE(Percentile95(offsets), 1.2 * 1.96);
  }
}

TEST_F(PublishBrickTest, AreasOfTiltedPlanes) {
  const auto turn = [](double angle, double x, double y, double z) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(x, y, z).normalized()));
  };
  std::vector<Eigen::Quaterniond> turns = {turn(0.4, 0, 1, 0.5), turn(0, 0, 0, 1),
                                           turn(0.3, 0, 0, 1), turn(0.785, 0, 0, 1),
                                           turn(0.6, 0.2, 1, 1)};
  turns.resize(test_support::Runs(turns.size()));
  for (const Eigen::Quaterniond& R : turns) {
    // The number of voxels that a plane crosses depends on where it lies in the grid; the area of
    // each is right on average over that.
    double ratio = 0;
    const std::vector<Eigen::Vector3d> places = {
        {1.3617, 0.1043, 1.4}, {1.3391, 0.0872, 1.4}, {1.3818, 0.1127, 1.4}};
    for (const Eigen::Vector3d& point : places) {
      ClosedFormScene scene = EmptyRoom();
      // A big slab that faces the scanner; its face fills the middle of the view.
      const Eigen::Vector3d face = R * -Eigen::Vector3d::UnitX();
      scene.solids.push_back({point - 0.5 * face, {0.5, 0.9, 0.9}, R});
      Build(scene);
      const double half = 0.55;
      double area = 0;
      const Eigen::Vector3d u = face.unitOrthogonal();
      const Eigen::Vector3d v = face.cross(u);
      view_->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& s) {
        if (state != VoxelState::kTrueSurface) return;
        const Eigen::Vector3d off = s.centroid.cast<double>() - point;
        if (std::abs(off.dot(face)) > 0.04) return;
        if (std::abs(off.dot(u)) > half || std::abs(off.dot(v)) > half) return;
        area += static_cast<double>(s.area);
      });
      ratio += area / (4 * half * half) / static_cast<double>(places.size());
    }
    EXPECT_NEAR(ratio, 1.0, 0.05) << R.coeffs().transpose();
  }
}

TEST_F(PublishBrickTest, RecordedDensityIsTheClosedForm) {
  Build(EmptyRoom());
  const Plane wall{{scene_.air[0].max().x(), 0, 1.3}, {-1, 0, 0}};
  size_t voxels = 0;
  size_t wrong = 0;
  OnPlane(wall, 1.0, 1.0, [&](const SurfaceVoxel& s) {
    // The smallest over the piece of wall inside the voxel, from the wall's true normal.
    double expected = 1e9;
    for (const double dy : {-0.5, 0.0, 0.5}) {
      for (const double dz : {-0.5, 0.0, 0.5}) {
        const Eigen::Vector3d to =
            s.centroid.cast<double>() + kVoxel * Eigen::Vector3d(0, dy, dz) - pose_.translation();
        const double range = to.norm();
        const double cos_incidence = std::abs(to.x()) / range;
        const Eigen::Vector3d in_scan = pose_.linear().transpose() * to;
        const double elevation = std::asin(in_scan.z() / range);
        const double rho = 1 / (scan_.image.native_azimuth_step *
                                scan_.image.native_elevation_step * std::cos(elevation));
        expected = std::min(expected, rho * cos_incidence / (range * range));
      }
    }
    ++voxels;
    wrong += std::abs(static_cast<double>(s.density) / expected - 1) > 0.10 ? 1 : 0;
  });
  ASSERT_GT(voxels, 1000u);
  EXPECT_LE(wrong, voxels / 200);
}

// Thinned for transport: the density is that of the steps the instrument measured with.
TEST_F(PublishBrickTest, AThinnedScanRecordsItsNativeDensity) {
  Build(EmptyRoom());
  sensor::Scan thinned = scan_;
  sensor::RangeImage& image = thinned.image;
  image.azimuth.clear();
  image.elevation.clear();
  image.range.clear();
  for (int c = 0; c < scan_.image.columns(); c += 3) {
    image.azimuth.push_back(scan_.image.azimuth[static_cast<size_t>(c)]);
    for (int r = 0; r < scan_.image.rows(); r += 2) image.range.push_back(scan_.image.at(c, r));
  }
  for (int r = 0; r < scan_.image.rows(); r += 2) {
    image.elevation.push_back(scan_.image.elevation[static_cast<size_t>(r)]);
  }
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  ASSERT_TRUE(model->Insert("thinned", thinned, pose_, serial).ok());
  const auto view = model->Publish();
  size_t compared = 0;
  size_t wrong = 0;
  const Plane wall{{scene_.air[0].max().x(), 0, 1.3}, {-1, 0, 0}};
  OnPlane(wall, 1.0, 1.0, [&](const SurfaceVoxel& whole) {
    const std::optional<SurfaceVoxel> thin = view->Surface(view->At(whole.centroid.cast<double>()));
    if (!thin.has_value()) return;
    ++compared;
    wrong += std::abs(thin->density / whole.density - 1) > 0.10f ? 1 : 0;
  });
  ASSERT_GT(compared, 1000u);
  EXPECT_LE(wrong, compared / 100);
}

TEST_F(PublishBrickTest, GrazingSurfaceHasNoDensity) {
  ClosedFormScene scene;
  scene.air = {{Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(12, 1, 2.5)}};
  scene.stations = {{0, 0, 1.5}};
  Build(scene);
  // The floor from 75 degrees of incidence on: 1.5 m * tan 75 = 5.6 m.
  size_t grazed = 0;
  size_t measured = 0;
  view_->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& s) {
    if (state != VoxelState::kTrueSurface || s.normal.z() < 0.99f) return;
    if (std::abs(s.centroid.y()) > 0.5f) return;
    if (s.centroid.x() > 6.2f && s.centroid.x() < 8) {
      EXPECT_EQ(s.density, 0);
      ++grazed;
    } else if (s.centroid.x() > 2 && s.centroid.x() < 5) {
      EXPECT_GT(s.density, 0);
      ++measured;
    }
  });
  EXPECT_GT(grazed, 100u);
  EXPECT_GT(measured, 500u);
}

TEST_F(PublishBrickTest, FalseSurfaceFacesTheEmptySide) {
  Build(PillarRoom());
  size_t clear = 0;
  size_t ambiguous = 0;
  view_->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& s) {
    EXPECT_NEAR(s.normal.norm(), 1, 1e-5);
    EXPECT_GT(s.area, 0);
    if (!IsFalseSurface(state)) return;
    EXPECT_EQ(s.density, 0);
    ++(s.ambiguous ? ambiguous : clear);
    if (s.ambiguous) return;
    // One step along the normal is nearer to empty space than one against it.
    int towards = 0;
    int away = 0;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (!view_->Empty(v + VoxelIndex(dx, dy, dz))) continue;
          const float side = s.normal.dot(Eigen::Vector3i(dx, dy, dz).cast<float>());
          towards += side > 0.01f ? 1 : 0;
          away += side < -0.01f ? 1 : 0;
        }
      }
    }
    EXPECT_GT(towards, away);
  });
  EXPECT_GT(clear, 1000u);
  EXPECT_LT(ambiguous, clear / 10);
}

// A fin of unknown one voxel thick has empty space on both sides: its normal is a guess, and said
// so.
TEST_F(PublishBrickTest, ThinFinsAreMarkedAmbiguous) {
  const ClosedFormScene scene = EmptyRoom();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0]);
  sensor::Scan scan = ScanScene(scene, pose, {});
  // Four columns without returns: a fin that widens with the distance, one voxel thick in the room.
  for (int c = 300; c < 304; ++c) {
    for (int r = 0; r < scan.image.rows(); ++r) {
      scan.image.range[scan.image.Index(c, r)] = sensor::RangeImage::kNoReturn;
    }
  }
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  ASSERT_TRUE(model->Insert("a", scan, pose, serial).ok());
  size_t fins = 0;
  size_t marked = 0;
  model->Publish()->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& s) {
    if (state != VoxelState::kFalseHole) return;
    ++fins;
    marked += s.ambiguous ? 1 : 0;
  });
  EXPECT_GT(fins, 20u);
  EXPECT_GT(marked, fins / 2);
}

}  // namespace
}  // namespace vantage::model
