// Found openings against the doorways that generated scenes were built with, after each scan of a
// job, at the steps of fine, usual and coarse scanners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/openings.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

constexpr double kHeadHeight = 1.6;  // m, at which doorways are looked through
constexpr double kSeenBeyond = 0.5;  // m behind the middle of a doorway that was looked through
constexpr double kSamePlace = 0.35;  // m from a doorway's middle to that of what was found
constexpr double kWidthError = 0.1 + 1e-6;  // m, two voxels

struct Figures {
  int seen = 0;            // doorways that some station looks through, over all scans
  int found = 0;           // of those, that are found
  int told = 0;            // doorways that are told
  int real = 0;            // of those, that are
  int right_width = 0;     // of those found, with a width that is right to two voxels
  double worst_width = 0;  // m, by which a width is wrong
};

bool LookedThrough(const simulation::SceneDoorway& door, const std::vector<Eigen::Vector3d>& from,
                   const simulation::SimulatedScanner& tracer) {
  const Eigen::Vector2d across(-door.along.y(), door.along.x());
  for (const Eigen::Vector3d& station : from) {
    const double side = across.dot(station.head<2>() - door.middle) > 0 ? -1 : 1;
    const Eigen::Vector2d behind = door.middle + side * kSeenBeyond * across;
    if (tracer.Visible(station, {behind.x(), behind.y(), kHeadHeight})) return true;
  }
  return false;
}

bool Is(const Opening& opening, const simulation::SceneDoorway& door) {
  return opening.doorway() && (opening.centre.head<2>() - door.middle).norm() < kSamePlace;
}

// Scans from the scene's starts, one in each room, and adds up what is found after each scan.
void JudgeJob(const simulation::Scene& scene, double step, size_t most_scans,
              parallel::Parallel& parallel, Figures& figures) {
  const simulation::SimulatedScanner tracer(scene.mesh);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(step);
  auto model = model::PartialModel::Create({}).value();
  std::vector<Eigen::Vector3d> stations;
  for (size_t i = 0; i < std::min(most_scans, scene.starts.size()); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(scene.starts[i]);
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, i, parallel);
    ASSERT_TRUE(model->Insert("scan" + std::to_string(i), scan, pose, parallel).ok());
    stations.push_back(scene.starts[i]);
    const auto view = model->Publish();
    const Openings found = FindOpenings(*view, FloorMap::Find(*view, std::nullopt).value()).value();
    const auto& openings = found.openings;
    for (const simulation::SceneDoorway& door : scene.doorways) {
      if (!LookedThrough(door, stations, tracer)) continue;
      ++figures.seen;
      const auto it = std::find_if(openings.begin(), openings.end(),
                                   [&](const Opening& opening) { return Is(opening, door); });
      if (it == openings.end()) {
        std::printf("%s after %zu: missed (%.2f, %.2f)\n", scene.name.c_str(), i + 1,
                    door.middle.x(), door.middle.y());
        continue;
      }
      ++figures.found;
      figures.right_width += std::abs(it->width - door.width) <= kWidthError ? 1 : 0;
      figures.worst_width = std::max(figures.worst_width, std::abs(it->width - door.width));
    }
    for (const Opening& opening : openings) {
      if (!opening.doorway()) continue;
      ++figures.told;
      const bool real = std::any_of(scene.doorways.begin(), scene.doorways.end(),
                                    [&](const auto& door) { return Is(opening, door); });
      figures.real += real ? 1 : 0;
      if (real) continue;
      std::printf("%s after %zu: none at (%.2f, %.2f), %.2f m wide, head %.2f\n",
                  scene.name.c_str(), i + 1, opening.centre.x(), opening.centre.y(), opening.width,
                  opening.head);
    }
    // Each room has one start. There are so many rooms at least: never more than there are.
    EXPECT_LE(found.RoomsNotEntered(), static_cast<int>(scene.starts.size() - i - 1)) << i;
  }
}

// The least share of what is seen that has to be found: what holds today, less a doorway.
struct DoorsAt {
  double step;  // degrees
  double least_found;
};
void PrintTo(const DoorsAt& at, std::ostream* out) { *out << at.step << " degrees"; }

class DoorsOfScenesTest : public ::testing::TestWithParam<DoorsAt> {};

// So few jobs that the finest scans, each of which takes ten times as long, can do them.
Figures JudgeFewJobs(double step, parallel::Parallel& parallel) {
  Figures figures;
  for (const uint64_t seed : {1, 7}) {
    JudgeJob(simulation::FurnishedFlat(seed), step, 2, parallel, figures);
  }
  JudgeJob(simulation::TwoRooms(1), step, 1, parallel, figures);
  return figures;
}

Figures JudgeJobs(double step, parallel::Parallel& parallel) {
  Figures figures;
  for (const uint64_t seed : {1, 2, 3, 4, 5, 7}) {
    JudgeJob(simulation::FurnishedFlat(seed), step, 4, parallel, figures);
  }
  JudgeJob(simulation::TwoRooms(1), step, 1, parallel, figures);
  JudgeJob(simulation::OfficeStorey(1, 250), step, 4, parallel, figures);
  return figures;
}

TEST_P(DoorsOfScenesTest, AreFoundAndHardlyAnythingElse) {
  parallel::ThreadPool pool(2);
  const double step = GetParam().step;
  const bool fine = step < 0.2;
  const Figures figures = fine ? JudgeFewJobs(step, pool) : JudgeJobs(step, pool);
  std::printf("%.2f degrees: %d of %d found, %d of %d real, widths to %.3f m\n", step,
              figures.found, figures.seen, figures.real, figures.told, figures.worst_width);
  // What holds today; the aims are 0.9 of those seen and 0.95 real. What is missed was seen at a
  // grazing angle, with little behind it. Of ten that are none, in 95 at a quarter of a degree, two
  // are a mirror of which several scans told only a part to be one: the strip of a room that is
  // left looks as if seen through a doorway.
  EXPECT_GE(figures.found, GetParam().least_found * figures.seen);
  if (fine) {
    EXPECT_GE(figures.found, JudgeFewJobs(0.25, pool).found) << "finer, and finds less";
  }
  EXPECT_GE(figures.real, 0.89 * figures.told);
  EXPECT_GE(figures.right_width, 0.95 * figures.found);
  EXPECT_LE(figures.worst_width, 1.5 * kWidthError);
}

// Doors of flats that were seen from along their walls by an instrument's steps, sent as previews.
struct GrazedDoor {
  const char* name;
  uint64_t flat;
  std::vector<Eigen::Vector3d> stations;
  Eigen::Vector2d door;
};
void PrintTo(const GrazedDoor& grazed, std::ostream* out) { *out << grazed.name; }

class GrazedDoorTest : public ::testing::TestWithParam<GrazedDoor> {};

TEST_P(GrazedDoorTest, IsFound) {
  const GrazedDoor& grazed = GetParam();
  parallel::ThreadPool pool(2);
  const simulation::Scene scene = simulation::FurnishedFlat(grazed.flat);
  const simulation::SimulatedScanner tracer(scene.mesh);
  const sensor::Preset instrument = sensor::FindPreset("leica-rtc360").value();
  const sensor::ScannerModel scanner = instrument.At(instrument.Setting("").value());
  auto model = model::PartialModel::Create({}).value();
  for (size_t i = 0; i < grazed.stations.size(); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(grazed.stations[i]);
    pose.rotate(Eigen::AngleAxisd(0.7 * static_cast<double>(i), Eigen::Vector3d::UnitZ()));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, 1000 * grazed.flat + i + 1,
                             pool, sensor::Radians(0.25));
    const std::string name = "scan" + std::to_string(i);
    ASSERT_TRUE(model->Insert(name, scan, pose, pool).ok());
  }
  const auto view = model->Publish();
  const Openings found = FindOpenings(*view, FloorMap::Find(*view, std::nullopt).value()).value();
  const auto door = std::find_if(
      scene.doorways.begin(), scene.doorways.end(),
      [&](const auto& doorway) { return (doorway.middle - grazed.door).norm() < 0.1; });
  ASSERT_NE(door, scene.doorways.end());
  EXPECT_TRUE(std::any_of(found.openings.begin(), found.openings.end(), [&](const auto& opening) {
    return opening.doorway() && Is(opening, *door);
  }));
}

INSTANTIATE_TEST_SUITE_P(
    Doors, GrazedDoorTest,
    ::testing::Values(
        // Of which no more is seen than the face of its wall, over a cabinet beside it.
        GrazedDoor{"FaceOfTheWallAlone", 1, {{2.945, 5.032, 1.25}}, {6.74, 6.45}}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(Steps, DoorsOfScenesTest,
                         ::testing::Values(DoorsAt{0.08, 0.6}, DoorsAt{0.25, 0.84},
                                           DoorsAt{1.0, 0.84}));

}  // namespace
}  // namespace vantage::planning
