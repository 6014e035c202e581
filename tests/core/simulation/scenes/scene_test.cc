#include "core/simulation/scenes/scene.h"

#include <gtest/gtest.h>

#include <cstring>
#include <ostream>

#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/standable_positions.h"
#include "core/simulation/walkable_ground.h"

namespace vantage::simulation {
namespace {

struct SceneCase {
  std::string name;
  Scene (*make)(uint64_t seed);
  uint64_t seed;
  size_t least_starts;
  size_t least_triangles;
};
// What test names show.
void PrintTo(const SceneCase& tested, std::ostream* out) { *out << tested.name; }

std::vector<SceneCase> Cases() {
  std::vector<SceneCase> cases;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const std::string s = std::to_string(seed);
    cases.push_back({"Flat" + s, FurnishedFlat, seed, 4, 8000});
    cases.push_back({"TwoRooms" + s, TwoRooms, seed, 2, 500});
    cases.push_back({"PillarHall" + s, PillarHall, seed, 4, 1000});
    cases.push_back({"House" + s, HouseOfThreeStoreys, seed, 7, 8000});
  }
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const std::string s = std::to_string(seed);
    cases.push_back(
        {"SmallOffice" + s, [](uint64_t x) { return OfficeStorey(x, 150); }, seed, 3, 4000});
    cases.push_back(
        {"Office" + s, [](uint64_t x) { return OfficeStorey(x, 600); }, seed, 10, 20'000});
  }
  cases.push_back({"LargeOffice", [](uint64_t x) { return OfficeStorey(x, 2000); }, 1, 40, 80'000});
  return cases;
}

class SceneTest : public testing::TestWithParam<SceneCase> {
 protected:
  const SceneCase& Case() const { return GetParam(); }
  Scene Make() const { return Case().make(Case().seed); }
};

TEST_P(SceneTest, SameSeedSameSceneAndAnotherSeedAnotherScene) {
  const Scene a = Make();
  const Scene b = Make();
  ASSERT_EQ(a.mesh.vertices.size(), b.mesh.vertices.size());
  EXPECT_EQ(std::memcmp(a.mesh.vertices.data(), b.mesh.vertices.data(),
                        sizeof(Eigen::Vector3f) * a.mesh.vertices.size()),
            0);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.mesh.material, b.mesh.material);
  EXPECT_EQ(a.starts, b.starts);
  EXPECT_NE(a.name, Case().make(Case().seed + 100).name);
  EXPECT_NE(a.starts, Case().make(Case().seed + 100).starts);
}

void ExpectClosedAndReachable(const Scene& scene, size_t least_triangles, size_t least_starts) {
  EXPECT_GE(scene.mesh.triangles.size(), least_triangles);
  ASSERT_GE(scene.starts.size(), least_starts);
  EXPECT_EQ(scene.mesh.material.size(), scene.mesh.triangles.size());
  const SimulatedScanner simulated(scene.mesh);
  parallel::Serial serial;
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1);
  scanner.elevation_min = sensor::Radians(-89);
  scanner.range_min = 0.01;
  scanner.range_max = 500;
  for (const Eigen::Vector3d& start : scene.starts) {
    // Glass returns here, so a cell without a range is a hole in the building.
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(start);
    const sensor::RangeImage image = simulated.Scan(scanner, pose, ScanFaults::None(), 1, serial);
    EXPECT_EQ(image.SampleCount(), image.cells()) << start.transpose();
    EXPECT_TRUE(simulated.tracer().CylinderFree(start.head<2>(), 0.45, start.z() - 1.45, start.z()))
        << start.transpose();
    EXPECT_GT(simulated.Clearance(start, 1), 0.45) << start.transpose();
  }
  // From the first start a scanner of 0.35 m clearance gets next to all the others.
  const std::vector<Eigen::Vector3d> positions =
      scene.several_levels ? WalkableGround(simulated, scene.mesh.Bounds(), scene.starts.front())
                                 .Stations(1.5, 0.35, 0.25)
                           : StandablePositions(simulated, scene.mesh.Bounds(),
                                                scene.starts.front(), 0, 1.5, 0.35, 0.25);
  for (const Eigen::Vector3d& start : scene.starts) {
    double nearest = 100;
    for (const Eigen::Vector3d& p : positions) nearest = std::min(nearest, (p - start).norm());
    EXPECT_LT(nearest, 0.2) << start.transpose();
  }
}

TEST_P(SceneTest, IsClosedAndEveryPlaceIsReachable) {
  ExpectClosedAndReachable(Make(), Case().least_triangles, Case().least_starts);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SceneTest, testing::ValuesIn(Cases()),
                         [](const auto& suite) { return suite.param.name; });

TEST(FurnishedFlatTest, HasWhatMakesScanningHard) {
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const Scene flat = FurnishedFlat(seed);
    const Eigen::Vector3d size = flat.mesh.Bounds().sizes();
    EXPECT_NEAR(size.x(), 12.5, 0.6);
    EXPECT_NEAR(size.y(), 9.8, 0.6);
    EXPECT_NEAR(size.z(), 2.7, 0.15);
    std::array<int, 4> materials{};
    for (const Material material : flat.mesh.material) ++materials[static_cast<size_t>(material)];
    EXPECT_GE(materials[static_cast<size_t>(Material::kGlass)], 2 * 8);
    EXPECT_GE(materials[static_cast<size_t>(Material::kMirror)], 2);
    EXPECT_GE(materials[static_cast<size_t>(Material::kDark)], 12);
  }
}

// Made once: so large a place takes its time.
TEST(LargeHallTest, HasItsSizeAndWhatStandsInIt) {
  const Scene scene = LargeHall(1);
  // Columns, shelves and crates have a thousand triangles and more, the bare hall 160.
  ExpectClosedAndReachable(scene, 1000, 8);
  // The slabs reach a quarter of a metre beyond the walls.
  const Eigen::Vector3d size = scene.mesh.Bounds().sizes();
  EXPECT_NEAR(size.x(), 100.5, 0.1);
  EXPECT_NEAR(size.y(), 60.5, 0.1);
  EXPECT_NEAR(size.z(), 15, 0.6);
}

TEST(OfficeStoreyTest, HasTheAreaAskedFor) {
  for (const double area : {150.0, 600.0, 2000.0}) {
    const Eigen::Vector3d size = OfficeStorey(5, area).mesh.Bounds().sizes();
    // The slabs reach a quarter of a metre beyond the walls.
    EXPECT_NEAR((size.x() - 0.5) * (size.y() - 0.5), area, 0.01 * area);
  }
}

}  // namespace
}  // namespace vantage::simulation
