// Rays into the open sky, against meshes: what they make empty is free, and a room whose ceiling
// does not return is no yard.
#include "core/model/carve/sky_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/model/scan/sky.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/mesh_solids.h"

namespace vantage::model {
namespace {

using Eigen::Vector3d;
using simulation::Material;

constexpr double kCoarseVoxel = 0.1;

sensor::ScannerModel Scanner() {
  sensor::ScannerModel scanner;
  scanner.range_max = 40;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
  return scanner;
}

ModelConfig Config() {
  ModelConfig config;
  config.voxel_size = kCoarseVoxel;
  return config;
}

struct Made {
  std::vector<MergeReport> reports;
  std::shared_ptr<const PlanningView> view;
  uint64_t digest = 0;
};

// One scan from each place, in this order.
Made ScanFrom(const simulation::TriangleMesh& mesh, const std::vector<Vector3d>& places,
              const simulation::ScanFaults& faults, int threads = 2, bool backwards = false) {
  const simulation::SimulatedScanner tracer(mesh);
  parallel::ThreadPool pool(threads);
  auto model = PartialModel::Create(Config()).value();
  Made made;
  for (size_t k = 0; k < places.size(); ++k) {
    const size_t i = backwards ? places.size() - 1 - k : k;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(places[i]);
    pose.rotate(Eigen::AngleAxisd(0.4 + static_cast<double>(i), Vector3d::UnitZ()));
    pose.rotate(Eigen::AngleAxisd(0.02, Vector3d::UnitX()));  // tilted, as real ones are
    sensor::Scan scan;
    scan.scanner = Scanner();
    scan.image = tracer.Scan(scan.scanner, pose, faults, i + 1, pool);
    made.reports.push_back(model->Insert("scan" + std::to_string(i), scan, pose, pool).value());
  }
  made.view = model->Publish();
  made.digest = model->Digest();
  return made;
}

std::vector<simulation::Scene> OutdoorScenes() {
  std::vector<simulation::Scene> scenes;
  for (const uint64_t seed : {1u, 2u}) {
    scenes.push_back(simulation::FacadeScene(seed));
    scenes.push_back(simulation::CourtyardScene(seed));
    scenes.push_back(simulation::StreetScene(seed));
    scenes.push_back(simulation::SlopeScene(seed));
  }
  return scenes;
}

class SkySceneTest : public testing::TestWithParam<simulation::Scene> {};

TEST_P(SkySceneTest, WhereNothingIsSpaceIsEmpty) {
  const simulation::Scene& scene = GetParam();
  const Made made = ScanFrom(scene.mesh, scene.starts, {});
  const simulation::SimulatedScanner tracer(scene.mesh);
  for (const Vector3d& start : scene.starts) {
    size_t sky = 0;
    size_t empty = 0;
    for (double azimuth = 0; azimuth < 6.28; azimuth += 0.1) {
      for (double elevation = sensor::Radians(15); elevation < 1.57; elevation += 0.07) {
        const Vector3d direction(std::cos(azimuth) * std::cos(elevation),
                                 std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
        if (tracer.tracer().Trace(start.cast<float>(), direction.cast<float>(), 0).hit) continue;
        for (const double distance : {1.0, 3.0, 5.0}) {
          ++sky;
          empty += made.view->Empty(made.view->At(start + distance * direction)) ? 1 : 0;
        }
      }
    }
    EXPECT_GT(sky, 500u);
    EXPECT_GT(static_cast<double>(empty), 0.97 * static_cast<double>(sky));
  }
}

// Brute force on every voxel.
TEST_P(SkySceneTest, NothingIsEmptyInsideWhatIsThere) {
  const simulation::Scene& scene = GetParam();
  const Made made = ScanFrom(scene.mesh, scene.starts, {});
  for (const MergeReport& report : made.reports) EXPECT_GT(report.sky_rays, 20'000u);
  const MeshSolids solids(scene.mesh);
  size_t deep = 0;
  double deepest = 0;
  for (const BrickAt& at : made.view->bricks()) {
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (at.contents->state[static_cast<size_t>(local)] != VoxelState::kEmpty) continue;
      const Vector3d centre = made.view->Centre(PlanningView::Global(at.brick, local));
      for (const uint32_t solid : solids.Containing(centre)) {
        const double depth = solids.DepthIn(solid, centre);
        double nearest = 1e9;
        for (const Vector3d& start : scene.starts) {
          nearest = std::min(nearest, (centre - start).norm());
        }
        // Half a voxel's diagonal, and half the distance between rays that meet it grazing.
        const double allowed = 0.87 * kCoarseVoxel + nearest * sensor::Radians(0.5);
        if (depth <= allowed) continue;
        ++deep;
        deepest = std::max(deepest, depth);
      }
    }
  }
  EXPECT_EQ(deep, 0u) << "the deepest by " << deepest << " m";
}

TEST_P(SkySceneTest, OrderAndThreadsDoNotShow) {
  const simulation::Scene& scene = GetParam();
  EXPECT_EQ(ScanFrom(scene.mesh, scene.starts, {}, 1, true).digest,
            ScanFrom(scene.mesh, scene.starts, {}, 3).digest);
}

INSTANTIATE_TEST_SUITE_P(Outdoors, SkySceneTest, testing::ValuesIn(OutdoorScenes()),
                         [](const auto& scene) {
                           std::string name = scene.param.name;
                           for (char& c : name) c = c == ' ' ? '_' : c;
                           return name;
                         });

// A room of `size` (m) with a ceiling of one material, or of another within a middle part.
simulation::TriangleMesh Room(const Vector3d& size, Material ceiling, double middle,
                              Material in_middle) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  builder.Box({-0.2, -0.2, -0.2}, {size.x() + 0.2, size.y() + 0.2, 0});
  builder.Box({-0.2, -0.2, 0}, {0, size.y() + 0.2, size.z()});
  builder.Box({size.x(), -0.2, 0}, {size.x() + 0.2, size.y() + 0.2, size.z()});
  builder.Box({0, -0.2, 0}, {size.x(), 0, size.z()});
  builder.Box({0, size.y(), 0}, {size.x(), size.y() + 0.2, size.z()});
  const auto part = [&](double x0, double y0, double x1, double y1, Material material) {
    builder.Quad({Vector3d(x0, y0, size.z()), Vector3d(x1, y0, size.z()),
                  Vector3d(x1, y1, size.z()), Vector3d(x0, y1, size.z())},
                 material);
  };
  const double x0 = 0.5 * (size.x() - middle), x1 = x0 + middle;
  const double y0 = 0.5 * (size.y() - middle), y1 = y0 + middle;
  part(0, 0, x0, size.y(), ceiling);
  part(x1, 0, size.x(), size.y(), ceiling);
  part(x0, 0, x1, y0, ceiling);
  part(x0, y1, x1, size.y(), ceiling);
  part(x0, y0, x1, y1, in_middle);
  return mesh;
}

void ExpectNoSky(const simulation::TriangleMesh& mesh, const std::vector<Vector3d>& places,
                 const simulation::ScanFaults& faults, double ceiling) {
  const Made made = ScanFrom(mesh, places, faults);
  for (const MergeReport& report : made.reports) EXPECT_EQ(report.sky_rays, 0u);
  size_t above = 0;
  for (const BrickAt& at : made.view->bricks()) {
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (at.contents->state[static_cast<size_t>(local)] != VoxelState::kEmpty) continue;
      const Vector3d centre = made.view->Centre(PlanningView::Global(at.brick, local));
      above += centre.z() > ceiling + kCoarseVoxel ? 1 : 0;
    }
  }
  EXPECT_EQ(above, 0u);
}

// Over a bare field space is empty to five metres over what was measured, which is nothing above
// the scanner, and no higher.
TEST(SkyRaysTest, NothingIsEmptyFarAboveWhatWasMeasured) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  builder.Quad(
      {Vector3d(-30, -30, 0), Vector3d(30, -30, 0), Vector3d(30, 30, 0), Vector3d(-30, 30, 0)});
  const Made made = ScanFrom(mesh, {{0, 0, 1.5}}, simulation::ScanFaults::None());
  ASSERT_GT(made.reports[0].sky_rays, 10'000u);
  for (const double x : {-3.0, 0.4, 5.0}) {
    EXPECT_TRUE(made.view->Empty(made.view->At({x, 0.3, 1.5 + 4.7}))) << x;
    EXPECT_FALSE(made.view->Empty(made.view->At({x, 0.3, 1.5 + 5.4}))) << x;
  }
}

TEST(SkyRaysTest, ABlackCeilingIsNoSky) {
  for (const double dropout : {0.5, 0.8, 1.0}) {
    simulation::ScanFaults faults;
    faults.dark_dropout = dropout;
    for (const Vector3d& size :
         {Vector3d(5, 4, 2.7), Vector3d(12, 9, 3.4), Vector3d(24, 16, 4.5)}) {
      SCOPED_TRACE(dropout);
      SCOPED_TRACE(size.transpose());
      const simulation::TriangleMesh mesh = Room(size, Material::kDark, 1, Material::kDark);
      ExpectNoSky(
          mesh, {0.5 * size.cwiseProduct(Vector3d(1, 1, 0)) + Vector3d(0, 0, 1.5), {1.2, 1.4, 1.5}},
          faults, size.z());
    }
  }
}

TEST(SkyRaysTest, ASkylightIsNoSky) {
  for (const double side : {0.8, 1.6, 3.0}) {
    SCOPED_TRACE(side);
    const Vector3d size(6, 5, 2.7);
    const simulation::TriangleMesh mesh = Room(size, Material::kMatte, side, Material::kGlass);
    ExpectNoSky(mesh, {{3, 2.5, 1.5}, {2.6, 2.1, 1.5}, {1.1, 1.3, 1.5}}, {}, size.z());
  }
}

TEST(SkyRaysTest, WindowsAreNoSky) {
  const simulation::Scene panes = simulation::PaneRoom({});
  for (const MergeReport& report : ScanFrom(panes.mesh, panes.starts, {}).reports) {
    EXPECT_EQ(report.sky_rays, 0u);
  }
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    for (const simulation::Scene& scene :
         {simulation::FurnishedFlat(seed), simulation::PillarHall(seed)}) {
      for (const MergeReport& report : ScanFrom(scene.mesh, scene.starts, {}).reports) {
        EXPECT_EQ(report.sky_rays, 0u) << scene.name;
      }
    }
  }
}

// What a scan of the yard says of the sky it says of no ceiling beside it: a room that opens onto
// the yard keeps its missing ceiling.
TEST(SkyRaysTest, UnderAnArcadeTheCeilingIsStillWanted) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  builder.Box({-8, -8, -0.2}, {8, 8, 0});
  builder.Box({-8, 4, 3.0}, {8, 8, 3.2}, Material::kDark);  // an arcade with a black ceiling
  builder.Box({-8, 8, 0}, {8, 8.2, 6});
  simulation::ScanFaults faults;
  faults.dark_dropout = 1;
  const Made made = ScanFrom(mesh, {{0, 0, 1.5}}, faults);
  EXPECT_GT(made.reports[0].sky_rays, 0u);
  size_t wanted = 0;
  made.view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
    const Vector3d centre = made.view->Centre(v);
    if (IsFalseSurface(state) && centre.y() > 4.5 && centre.y() < 7.8 && centre.z() < 3.2 &&
        std::abs(centre.x()) < 4) {
      ++wanted;
    }
  });
  EXPECT_GT(wanted, 100u);
}

}  // namespace
}  // namespace vantage::model
