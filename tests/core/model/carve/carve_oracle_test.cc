// Compares every voxel of one scan with the ranges that its centre and corners read in the range
// image, and with the scanned solids, for closed-form scenes, a generated flat and a mesh from
// elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>

#include "core/model/partial_model.h"
#include "core/model/view/model_config.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/mesh_ply.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/core/model/mesh_solids.h"
#include "tests/core/model/range_image_oracle.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

#ifdef VANTAGE_SANITIZED
constexpr double kOracleVoxel = 0.1;  // an eighth of the voxels
#else
constexpr double kOracleVoxel = 0.05;
#endif

// The result of the comparison.
struct Tally {
  size_t voxels = 0;
  size_t empty = 0;     // known-empty to the model
  size_t missed = 0;    // known-empty to the oracle only
  size_t invented = 0;  // known-empty to the model only
  size_t ties = 0;      // disagreements that rounding explains
  size_t border = 0;    // across the border of what is known: either is right
  double farthest = 0;  // m, the disagreement farthest from any surface
};

bool IsSurface(VoxelState state) {
  return state == VoxelState::kTrueSurface || state == VoxelState::kAbsorbed;
}

// `distance` gives the distance of a point to the nearest surface, m.
Tally Compare(const sensor::Scan& scan, const Eigen::Isometry3d& pose, const PlanningView& view,
              const std::function<double(const Eigen::Vector3d&)>& distance) {
  const RangeImageOracle oracle(scan, pose, kOracleVoxel, ModelConfig().discontinuity_angle);
  const VoxelBox& box = view.bounds();
  const VoxelIndex size = box.max - box.min;
  Tally tally;
  // Corners are shared: one layer of them below, one above.
  const auto row = static_cast<size_t>(size.x() + 1);
  std::array<std::vector<double>, 2> corners;
  const auto read_layer = [&](int z, std::vector<double>& layer) {
    layer.resize(row * static_cast<size_t>(size.y() + 1));
    size_t i = 0;
    for (int y = 0; y <= size.y(); ++y) {
      for (int x = 0; x <= size.x(); ++x) {
        layer[i++] = oracle.Room((box.min + VoxelIndex(x, y, z)).cast<double>() * kOracleVoxel);
      }
    }
  };
  read_layer(0, corners[1]);
  for (int z = 0; z < size.z(); ++z) {
    std::swap(corners[0], corners[1]);
    read_layer(z + 1, corners[1]);
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const VoxelIndex v = box.min + VoxelIndex(x, y, z);
        const Eigen::Vector3d centre = view.Centre(v);
        // The scanner's own station is always free; another test checks it.
        if ((centre - pose.translation()).head<2>().norm() < 0.5) continue;
        const size_t at = static_cast<size_t>(y) * row + static_cast<size_t>(x);
        std::array<double, 8> around;
        for (size_t i = 0; i < 8; ++i) {
          around[i] = corners[i >> 2][at + (i & 1) + (i >> 1 & 1) * row];
        }
        const RangeImageOracle::Verdict verdict = oracle.Of(v, oracle.Room(centre), around);
        const bool empty = view.Empty(v);
        ++tally.voxels;
        tally.empty += empty ? 1 : 0;
        if (verdict == RangeImageOracle::Verdict::kAcrossTheBorder) {
          ++tally.border;
          continue;
        }
        if (verdict == RangeImageOracle::Verdict::kEmptyOrSurface) {
          // Never unknown, though.
          if (empty || IsSurface(view.State(v))) continue;
        } else if (empty == (verdict == RangeImageOracle::Verdict::kEmpty)) {
          continue;
        }
        if (verdict == RangeImageOracle::Verdict::kEmpty && IsSurface(view.State(v)) &&
            oracle.NearTriangle(v)) {
          continue;
        }
        if (oracle.IsTie(v)) {
          ++tally.ties;
          continue;
        }
        ++(empty ? tally.invented : tally.missed);
        tally.farthest = std::max(tally.farthest, distance(centre));
      }
    }
  }
  return tally;
}

// The bounds that the model is held to.
void ExpectAgreement(const Tally& tally) {
  testing::Test::RecordProperty("voxels", static_cast<int>(tally.voxels));
  testing::Test::RecordProperty("missed", static_cast<int>(tally.missed));
  testing::Test::RecordProperty("invented", static_cast<int>(tally.invented));
  std::printf(
      "%zu voxels, %zu known empty: %zu missed, %zu invented, %zu ties, "
      "%zu border, farthest %.3f m\n",
      tally.voxels, tally.empty, tally.missed, tally.invented, tally.ties, tally.border,
      tally.farthest);
  ASSERT_GT(tally.empty, test_support::Runs(100'000u));
  EXPECT_LE(static_cast<double>(tally.missed + tally.invented),
            0.005 * static_cast<double>(tally.empty));
  EXPECT_LE(tally.farthest, kOracleVoxel);
  EXPECT_LE(tally.ties, tally.empty / 1000);
  // The border is a surface: its share of the volume goes with the voxel. 2.5 % at 5 cm.
  EXPECT_LE(static_cast<double>(tally.border),
            0.5 * kOracleVoxel * static_cast<double>(tally.empty));
}

std::shared_ptr<const PlanningView> ModelOf(const sensor::Scan& scan,
                                            const Eigen::Isometry3d& pose) {
  parallel::ThreadPool pool(2);
  auto model = PartialModel::Create({.voxel_size = kOracleVoxel}).value();
  EXPECT_TRUE(model->Insert("scan", scan, pose, pool).ok());
  return model->Publish();
}

class CarveOracleTest : public testing::TestWithParam<ClosedFormScene> {};

TEST_P(CarveOracleTest, EveryVoxelIsWhatTheRangeImageSays) {
  const ClosedFormScene& scene = GetParam();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0], 0.3, 0.02, -0.03);
  const sensor::Scan scan = ScanScene(scene, pose, {.noise = 0.003, .seed = 5});
  const auto view = ModelOf(scan, pose);
  ExpectAgreement(Compare(scan, pose, *view,
                          [&](const Eigen::Vector3d& p) { return scene.DistanceToSurface(p, 1); }));
}

std::vector<ClosedFormScene> Scenes() {
  std::vector<ClosedFormScene> scenes = AllScenes();
  scenes.resize(test_support::Runs(scenes.size()));
  return scenes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, CarveOracleTest, testing::ValuesIn(Scenes()),
                         [](const auto& tested) {
                           std::string name = tested.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

// Columns as irregular as a real scanner's, rows thinned unevenly, a sector instead of a full turn.
TEST(CarveGridTest, AnyGridIsWhatTheRangeImageSays) {
  const ClosedFormScene scene = BoxInRoom();
  for (const bool full_turn : {true, false}) {
    sensor::Scan scan = ScanScene(scene, PoseAt(scene.stations[0]), {});
    sensor::RangeImage& image = scan.image;
    std::mt19937_64 random(full_turn ? 17 : 18);
    image.azimuth.clear();
    image.elevation.clear();
    image.range.clear();
    image.full_turn = full_turn;
    const double end = full_turn ? sensor::kPi : 1.9;
    std::uniform_real_distribution<double> step(sensor::Radians(0.25), sensor::Radians(0.65));
    for (double a = -end + 0.001; a < end - sensor::Radians(0.25); a += step(random)) {
      image.azimuth.push_back(a);
    }
    for (double e = sensor::Radians(-58); e < sensor::Radians(89); e += step(random))
      image.elevation.push_back(e);
    const Eigen::Isometry3d pose = PoseAt(scene.stations[0], 0.4, -0.15, 0.1);  // well tilted
    for (int c = 0; c < image.columns(); ++c) {
      for (int r = 0; r < image.rows(); ++r) {
        image.range.push_back(static_cast<float>(
            scene.Cast(pose.translation(), pose.linear() * image.Direction(c, r), 30)));
      }
    }
    const auto view = ModelOf(scan, pose);
    ExpectAgreement(Compare(scan, pose, *view, [&](const Eigen::Vector3d& p) {
      return scene.DistanceToSurface(p, 1);
    }));
  }
}

// Known-empty voxels whose centres lie deeper than half a voxel inside a solid, or than half the
// distance between rays there, where that is more; `in_solids` counts all voxels whose centres lie
// in one.
size_t EmptyInSolids(const MeshSolids& solids, const PlanningView& view, const Eigen::Vector3d& eye,
                     double step, size_t& in_solids) {
  size_t wrong = 0;
  const VoxelBox& box = view.bounds();
  for (int z = box.min.z(); z < box.max.z(); ++z) {
    for (int y = box.min.y(); y < box.max.y(); ++y) {
      for (int x = box.min.x(); x < box.max.x(); ++x) {
        const VoxelIndex v(x, y, z);
        const Eigen::Vector3d centre = view.Centre(v);
        const std::vector<uint32_t> containing = solids.Containing(centre);
        in_solids += containing.empty() ? 0 : 1;
        if (!view.Empty(v)) continue;
        const double deepest = 1e-6 + std::max(kOracleVoxel / 2, step / 2 * (centre - eye).norm());
        wrong += std::any_of(containing.begin(), containing.end(), [&](uint32_t solid) {
          return solids.DepthIn(solid, centre) > deepest;
        });
      }
    }
  }
  return wrong;
}

void CheckMesh(const simulation::TriangleMesh& mesh, const Eigen::Vector3d& station,
               uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "station " << station.transpose() << ", seed " << seed);
  const simulation::SimulatedScanner simulated(mesh);
  simulation::ScanFaults faults;
  faults.mirror_reflections = false;  // what is behind a mirror is another test's
  faults.range_noise = false;         // a sample in a wall is no fault of the model's
  sensor::Scan scan;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(0.25);
  const Eigen::Isometry3d pose = PoseAt(station, 0.4, 0.02, -0.01);
  parallel::ThreadPool pool(2);
  scan.image = simulated.Scan(scan.scanner, pose, faults, seed, pool);
  const auto view = ModelOf(scan, pose);
  ExpectAgreement(Compare(scan, pose, *view,
                          [&](const Eigen::Vector3d& p) { return simulated.Clearance(p, 1); }));
  const MeshSolids solids(mesh);
  size_t in_solids = 0;
  EXPECT_EQ(EmptyInSolids(solids, *view, station, scan.scanner.azimuth_step, in_solids), 0u);
  std::printf("%zu solids, %zu voxels inside them\n", solids.solids(), in_solids);
  EXPECT_GT(in_solids, test_support::Runs(10'000u));
}

class CarveFlatTest : public testing::TestWithParam<uint64_t> {};

TEST_P(CarveFlatTest, EveryVoxelIsWhatTheRangeImageSays) {
  const simulation::Scene scene = simulation::FurnishedFlat(GetParam());
  CheckMesh(scene.mesh, scene.starts[0], GetParam());
}

INSTANTIATE_TEST_SUITE_P(Seeds, CarveFlatTest,
                         testing::Range(uint64_t{1}, 1 + test_support::Runs(uint64_t{2})));

TEST(CarveMeshTest, AMeshFromElsewhereIsWhatTheRangeImageSays) {
#ifdef VANTAGE_SANITIZED
  GTEST_SKIP() << "takes too long under sanitizers: the flat goes the same ways";
#endif
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  const std::string folder = std::string(data == nullptr ? "" : data) + "/small_house";
  if (!std::filesystem::exists(folder + "/scene.ply")) GTEST_SKIP() << folder << " is not here";
  const absl::StatusOr<simulation::TriangleMesh> mesh =
      simulation::ReadMeshPly(folder + "/scene.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  std::ifstream points(folder + "/free_points.txt");
  std::vector<Eigen::Vector3d> stations;
  for (std::string line; std::getline(points, line);) {
    std::istringstream numbers(line);
    Eigen::Vector3d p;
    if (numbers >> p.x() >> p.y() >> p.z()) stations.push_back(p);
  }
  ASSERT_GE(stations.size(), 10u);
  CheckMesh(*mesh, stations[stations.size() / 2], 3);
}

}  // namespace
}  // namespace vantage::model
