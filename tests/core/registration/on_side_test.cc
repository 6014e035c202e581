// Whether scans of a scanner on its side are told from those of an upright one, over many scenes
// and with all faults of a scanner.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/parallel/parallel.h"
#include "core/registration/levelling.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/scenes/mirror_scenes.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

// Scans of a scene from its starts and other free places of its rooms.
class ScannedScene {
 public:
  ScannedScene(const simulation::Scene& scene, uint64_t seed)
      : scene_(scene), simulated_(scene.mesh), random_(seed), places_(scene.starts) {
    constexpr size_t kPlaces = 5;
    for (int tries = 0; !scene.rooms.empty() && places_.size() < kPlaces && tries < 200; ++tries) {
      const auto& inside = scene.rooms[static_cast<size_t>(tries) % scene.rooms.size()].inside;
      const Eigen::Vector3d place(random_.Between(inside.min().x(), inside.max().x()),
                                  random_.Between(inside.min().y(), inside.max().y()),
                                  scene.floor_height + random_.Between(1.3, 1.8));
      if (simulated_.Clearance(place, 0.5) >= 0.45) places_.push_back(place);
    }
  }

  // Tripods are set up by eye, the scanner looks anywhere.
  std::vector<Levelling> Upright() {
    std::vector<Levelling> levels;
    for (size_t i = 0; i < places_.size(); ++i) {
      sensor::ScannerModel scanner = Scanner();
      if (i % 3 == 1) scanner.range_noise = 0.01;
      if (i % 3 == 2) {  // as some long-range scanners see
        scanner.elevation_min = sensor::Radians(-40);
        scanner.elevation_max = sensor::Radians(60);
      }
      levels.push_back(Level(
          scanner, PoseAt(places_[i], random_.Between(0, 6.2), random_.Between(-0.05, 0.05))));
    }
    return levels;
  }
  // Its +z towards one of the walls, within a few degrees.
  std::vector<Levelling> OnSide() {
    std::vector<Levelling> levels;
    for (size_t i = 0; i < places_.size(); ++i) {
      const double wall = 0.5 * sensor::kPi * static_cast<double>(i);
      Eigen::Isometry3d pose = PoseAt(places_[i], wall + random_.Between(-0.05, 0.05),
                                      0.5 * sensor::kPi + random_.Between(-0.05, 0.05));
      pose.rotate(Eigen::AngleAxisd(random_.Between(0, 6.2), Eigen::Vector3d::UnitZ()));
      levels.push_back(Level(Scanner(), pose));
    }
    return levels;
  }

 private:
  static sensor::ScannerModel Scanner() {
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.6);
    return scanner;
  }
  Levelling Level(const sensor::ScannerModel& scanner, const Eigen::Isometry3d& pose) {
    parallel::Serial serial;
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulated_.Scan(scanner, pose, {}, 5, serial);
    return LevelFirstScan(scan).value();
  }

  const simulation::Scene scene_;
  const simulation::SimulatedScanner simulated_;
  simulation::RandomSequence random_;
  std::vector<Eigen::Vector3d> places_;
};

// Nothing but six planes, of which each wall may be as near as the floor.
simulation::Scene EmptyRoom(uint64_t seed) {
  simulation::RandomSequence random(seed);
  const Eigen::Vector3d size(random.Between(2.5, 7), random.Between(2.5, 7),
                             random.Between(2.4, 3.2));
  simulation::Scene scene = simulation::BoxRoom(size);
  scene.rooms.push_back(
      {"room", Eigen::AlignedBox2d(Eigen::Vector2d::Zero(), Eigen::Vector2d(size.head<2>()))});
  return scene;
}

std::vector<simulation::Scene> OrdinaryScenes(uint64_t seed) {
  return {simulation::FurnishedFlat(seed),
          simulation::TwoRooms(seed),
          simulation::HouseOfThreeStoreys(seed),
          simulation::OfficeStorey(seed, 150),
          simulation::RandomMirrorScene(seed).scene,
          simulation::PillarHall(seed),
          EmptyRoom(seed)};
}

class OnSideTest : public testing::TestWithParam<uint64_t> {};

TEST_P(OnSideTest, UprightScansAreToldNothing) {
  std::vector<simulation::Scene> scenes = OrdinaryScenes(GetParam());
  scenes.push_back(simulation::CourtyardScene(GetParam()));
  scenes.push_back(simulation::StreetScene(GetParam()));
  scenes.push_back(simulation::FacadeScene(GetParam()));
  for (const simulation::Scene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    for (const Levelling& level : ScannedScene(scene, GetParam()).Upright()) {
      EXPECT_FALSE(level.maybe_on_side) << level.message;
    }
  }
}

// Rooms that are no wider than high look the same from all sides: one scan in seven cannot tell,
// and upright ones would have to be suspected with it.
TEST_P(OnSideTest, MostScansOnTheirSideAreToldSo) {
  int scans = 0;
  int silent = 0;
  for (const simulation::Scene& scene : OrdinaryScenes(GetParam())) {
    for (const Levelling& level : ScannedScene(scene, GetParam()).OnSide()) {
      ++scans;
      silent += level.message.empty() ? 1 : 0;
    }
  }
  EXPECT_GE(scans, 20);
  EXPECT_LE(silent, scans / 4) << "of " << scans;
}
// Corridors are narrower than high, which rooms hardly ever are.
TEST(CorridorTest, UprightScansAreToldNothing) {
  constexpr double kLength = 20;  // m
  for (const double height : {2.4, 2.7, 3.0}) {
    for (const double width : {1.4, 1.8, 2.2, 2.6, 3.0}) {
      SCOPED_TRACE(absl::StrCat(width, " m wide, ", height, " m high"));
      simulation::Scene scene = simulation::BoxRoom({kLength, width, height});
      scene.rooms.push_back({"corridor", Eigen::AlignedBox2d(Eigen::Vector2d(1, 0),
                                                             Eigen::Vector2d(kLength - 1, width))});
      for (const Levelling& level : ScannedScene(scene, 3).Upright()) {
        EXPECT_FALSE(level.maybe_on_side) << level.message;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, OnSideTest, testing::Range(uint64_t{0}, uint64_t{12}));

}  // namespace
}  // namespace vantage::registration
