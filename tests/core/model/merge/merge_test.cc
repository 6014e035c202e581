// The model as a function of the set of scans.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

struct PosedScan {
  std::string id;
  sensor::Scan scan;
  Eigen::Isometry3d pose;
};

std::vector<PosedScan> ScansOf(const ClosedFormScene& scene, const ScanOptions& base) {
  std::vector<PosedScan> scans;
  for (size_t i = 0; i < scene.stations.size(); ++i) {
    ScanOptions options = base;
    options.seed += i;
    const Eigen::Isometry3d pose =
        PoseAt(scene.stations[i], 0.7 * static_cast<double>(i), 0.01, -0.02);
    scans.push_back({"scan" + std::to_string(i), ScanScene(scene, pose, options), pose});
  }
  return scans;
}

TEST(MergeTest, TheOrderOfScansNeverShows) {
  for (uint64_t seed = 1; seed <= test_support::Runs(2u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    ScanOptions options;
    options.step = sensor::Radians(0.8);
    options.noise = 0.003;
    std::vector<PosedScan> scans = ScansOf(RandomScene(seed), options);
    parallel::Serial serial;
    std::vector<size_t> order = {0, 1, 2};
    std::optional<uint64_t> digest;
    do {
      auto model = PartialModel::Create({}).value();
      for (const size_t i : order) {
        ASSERT_TRUE(model->Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
      }
      if (!digest) digest = model->Digest();
      EXPECT_EQ(model->Digest(), *digest);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST(MergeTest, AReplacedScanNeverCameAndTheOtherStandsInItsPlace) {
  ScanOptions options;
  options.step = sensor::Radians(0.8);
  options.noise = 0.003;
  const std::vector<PosedScan> whole = ScansOf(RandomScene(12), options);
  options.step = sensor::Radians(2);
  const std::vector<PosedScan> preview = ScansOf(RandomScene(12), options);
  parallel::Serial serial;
  for (size_t replaced = 0; replaced < whole.size(); ++replaced) {
    auto model = PartialModel::Create({}).value();
    auto expected = PartialModel::Create({}).value();
    for (size_t i = 0; i < whole.size(); ++i) {
      const PosedScan& first = i == replaced ? preview[i] : whole[i];
      ASSERT_TRUE(model->Insert(first.id, first.scan, first.pose, serial).ok());
      ASSERT_TRUE(expected->Insert(whole[i].id, whole[i].scan, whole[i].pose, serial).ok());
    }
    EXPECT_NE(model->Digest(), expected->Digest());
    const auto place = [&](const PartialModel& of, size_t i) {
      return of.Publish()->stations()[i].position;
    };
    ASSERT_TRUE(model
                    ->Replace(preview[replaced].id, "whole", whole[replaced].scan,
                              whole[replaced].pose, serial)
                    .ok());
    EXPECT_EQ(model->Digest(), expected->Digest());
    EXPECT_EQ(model->scans().size(), whole.size());
    for (size_t i = 0; i < whole.size(); ++i) {
      EXPECT_EQ(place(*model, i), place(*expected, i)) << "the order in which they came";
    }
    const auto unknown =
        model->Replace("none", "other", whole[0].scan, whole[0].pose, serial).status();
    EXPECT_EQ(unknown.code(), absl::StatusCode::kNotFound);
    const auto twice =
        model->Replace("whole", "whole", whole[0].scan, whole[0].pose, serial).status();
    EXPECT_EQ(twice.code(), absl::StatusCode::kAlreadyExists);
    EXPECT_EQ(model->Digest(), expected->Digest());
  }
}

TEST(MergeTest, AWithdrawnScanNeverCame) {
  ScanOptions options;
  options.step = sensor::Radians(0.8);
  options.noise = 0.003;
  const std::vector<PosedScan> scans = ScansOf(RandomScene(11), options);
  parallel::Serial serial;
  for (size_t gone = 0; gone < scans.size(); ++gone) {
    auto with = PartialModel::Create({}).value();
    auto without = PartialModel::Create({}).value();
    for (size_t i = 0; i < scans.size(); ++i) {
      ASSERT_TRUE(with->Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
      if (i == gone) continue;
      ASSERT_TRUE(without->Insert(scans[i].id, scans[i].scan, scans[i].pose, serial).ok());
    }
    EXPECT_NE(with->Digest(), without->Digest());
    ASSERT_TRUE(with->Withdraw(scans[gone].id, serial).ok());
    EXPECT_EQ(with->Digest(), without->Digest());
  }
}

TEST(MergeTest, TheNumberOfThreadsNeverShows) {
  ScanOptions options;
  options.noise = 0.003;
  const std::vector<PosedScan> scans = ScansOf(RandomScene(21), options);
  std::optional<uint64_t> digest;
  for (const int width : {1, 2, 16}) {
    parallel::ThreadPool pool(width);
    auto model = PartialModel::Create({}).value();
    for (const PosedScan& s : scans) ASSERT_TRUE(model->Insert(s.id, s.scan, s.pose, pool).ok());
    if (!digest) digest = model->Digest();
    EXPECT_EQ(model->Digest(), *digest) << width << " threads";
  }
}

TEST(MergeTest, AViewOutlivesWhatComesAfterIt) {
  const std::vector<PosedScan> scans = ScansOf(RandomScene(5), {.step = sensor::Radians(0.8)});
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  ASSERT_TRUE(model->Insert(scans[0].id, scans[0].scan, scans[0].pose, serial).ok());
  const auto before = model->Publish();
  size_t surfaces = before->SurfaceCount();
  ASSERT_TRUE(model->Insert(scans[1].id, scans[1].scan, scans[1].pose, serial).ok());
  EXPECT_EQ(before->version() + 1, model->Publish()->version());
  size_t counted = 0;
  before->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
    EXPECT_EQ(before->State(v), state);
    ++counted;
  });
  EXPECT_EQ(counted, surfaces);
}

// The bricks of a view by their coordinates.
std::map<std::array<int, 3>, const Brick*> BricksOf(const PlanningView& view) {
  std::map<std::array<int, 3>, const Brick*> bricks;
  for (const BrickAt& at : view.bricks()) {
    bricks[{at.brick.x(), at.brick.y(), at.brick.z()}] = at.contents.get();
  }
  return bricks;
}

// A scan that comes or goes leaves alone what lies more than a brick from all that it says anything
// of: versions share it.
TEST(MergeTest, AScanTouchesOnlyWhatItSees) {
  ClosedFormScene scene = DoorwayRooms();
  scene.air.pop_back();  // no doorway: neither scan sees the other's room
  const std::vector<PosedScan> scans = ScansOf(scene, {.step = sensor::Radians(0.8)});
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  auto alone = PartialModel::Create({}).value();
  const PosedScan& second = scans[1];
  ASSERT_TRUE(alone->Insert(second.id, second.scan, second.pose, serial).ok());
  const auto touched = BricksOf(*alone->Publish());
  ASSERT_TRUE(model->Insert(scans[0].id, scans[0].scan, scans[0].pose, serial).ok());
  const auto before = model->Publish();
  ASSERT_TRUE(model->Insert(second.id, second.scan, second.pose, serial).ok());
  const auto with = model->Publish();
  const MergeReport gone = model->Withdraw(second.id, serial).value();
  const auto after = model->Publish();
  EXPECT_LE(gone.changed_bricks, 27 * touched.size());
  const auto all_with = BricksOf(*with);
  const auto all_after = BricksOf(*after);
  size_t shared = 0;
  size_t near = 0;
  for (const auto& [at, brick] : BricksOf(*before)) {
    bool by_the_scan = false;
    for (int i = 0; i < 27; ++i) {
      by_the_scan |=
          touched.contains({at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1});
    }
    near += by_the_scan ? 1 : 0;
    if (by_the_scan) continue;
    ++shared;
    ASSERT_TRUE(all_with.contains(at) && all_after.contains(at));
    EXPECT_EQ(all_with.at(at), brick);
    EXPECT_EQ(all_after.at(at), brick);
  }
  EXPECT_GT(shared, 200u);
  EXPECT_GT(near, 20u);
}

// The pages of bricks (8 x 8 x 8 of them) that hold any of these.
std::set<std::array<int, 3>> PagesOf(const std::map<std::array<int, 3>, const Brick*>& bricks) {
  std::set<std::array<int, 3>> pages;
  for (const auto& [at, brick] : bricks) pages.insert({at[0] >> 3, at[1] >> 3, at[2] >> 3});
  return pages;
}

// A small scan at the end of a row of rooms: what is published anew is what changed, whatever else
// there is.
TEST(MergeTest, PublishingCostsWhatChanged) {
  parallel::Serial serial;
  const ClosedFormScene room = EmptyRoom();
  auto model = PartialModel::Create({}).value();
  const auto insert = [&](int i) {
    Eigen::Isometry3d pose = PoseAt(room.stations[0], 0.7 * i, 0.01, -0.02);
    const sensor::Scan scan =
        ScanScene(room, pose, {.step = sensor::Radians(1.5), .seed = static_cast<uint64_t>(i + 1)});
    pose.pretranslate(Eigen::Vector3d(9.0 * i, 0, 0));
    return model->Insert("scan" + std::to_string(i), scan, pose, serial).value();
  };
  constexpr int kRooms = 5;
  for (int i = 0; i < kRooms; ++i) {
    const auto before = model->Publish();
    const auto bricks_before = BricksOf(*before);
    const MergeReport report = insert(i);
    const auto after = model->Publish();
    EXPECT_EQ(after, model->Publish()) << "nothing came between";
    EXPECT_EQ(after->copied_pages(), report.copied_pages);
    const auto bricks_after = BricksOf(*after);
    std::map<std::array<int, 3>, const Brick*> changed;
    for (const auto& [at, brick] : bricks_after) {
      const auto it = bricks_before.find(at);
      if (it == bricks_before.end() || it->second != brick) changed[at] = brick;
    }
    for (const auto& [at, brick] : bricks_before) {
      ASSERT_TRUE(bricks_after.contains(at));
    }
    EXPECT_EQ(report.changed_bricks, changed.size());
    EXPECT_LE(report.changed_bricks, report.recomputed_bricks);
    EXPECT_EQ(report.copied_pages, PagesOf(changed).size());
    if (i == 0) continue;
    // A room's own, of what by then are `i + 1` rooms.
    EXPECT_EQ(changed.size(), bricks_after.size() - bricks_before.size());
    EXPECT_LE(report.copied_pages, 2 * after->pages() / static_cast<size_t>(i + 1));
  }
}

// Ten scans of one wall with 1 cm of noise and 1 cm of pose error.
TEST(MergeTest, AWallStaysThin) {
  const ClosedFormScene scene = EmptyRoom();
  std::mt19937_64 random(7);
  std::normal_distribution<double> error(0, 0.01);
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d pose =
        PoseAt({-1.2 + 0.25 * i, 0.8 - 0.2 * i, 1.5}, 0.3 * i, 0.01, 0.01);
    const sensor::Scan scan =
        ScanScene(scene, pose, {.noise = 0.01, .seed = static_cast<uint64_t>(100 + i)});
    Eigen::Isometry3d wrong = pose;
    wrong.pretranslate(Eigen::Vector3d(error(random), error(random), error(random)));
    ASSERT_TRUE(model->Insert("scan" + std::to_string(i), scan, wrong, serial).ok());
  }
  const auto view = model->Publish();
  // Columns across the wall at x = 2.53, away from its edges.
  size_t columns = 0;
  size_t thin = 0;
  size_t false_layers = 0;
  for (int y = view->At({0, -1.7, 0}).y(); y < view->At({0, 1.6, 0}).y(); ++y) {
    for (int z = view->At({0, 0, 0.4}).z(); z < view->At({0, 0, 2.3}).z(); ++z) {
      int thickness = 0;
      for (int x = view->At({2.3, 0, 0}).x(); x <= view->At({2.8, 0, 0}).x(); ++x) {
        const VoxelState state = view->State({x, y, z});
        thickness += state == VoxelState::kTrueSurface ? 1 : 0;
        false_layers += IsFalseSurface(state) ? 1 : 0;
      }
      ++columns;
      thin += thickness >= 1 && thickness <= 2 ? 1 : 0;
    }
  }
  ASSERT_GT(columns, 2000u);
  EXPECT_GE(static_cast<double>(thin), 0.99 * static_cast<double>(columns));
  EXPECT_EQ(false_layers, 0u);
}

// A person in the first scan is gone when two others saw through where they stood; a wall that the
// others see from both sides stays.
TEST(MergeTest, PeopleLeaveAndWallsStay) {
  ClosedFormScene scene = ThinWallRoom();
  ClosedFormScene peopled = scene;
  const TurnedBox person{{-0.2, 1.2, 0.9}, {0.2, 0.15, 0.85}};
  peopled.solids.push_back(person);
  const std::vector<Eigen::Vector3d> stations = {
      {-0.9, -0.7, 1.5}, {1.7, 1.4, 1.5}, {-1.9, 1.3, 1.5}};
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  size_t person_before = 0;
  size_t person_after = 0;
  size_t wall_before = 0;
  size_t wall_after = 0;
  const auto count = [&](size_t& people, size_t& wall) {
    people = wall = 0;
    const auto view = model->Publish();
    view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
      if (state != VoxelState::kTrueSurface) return;
      const Eigen::Vector3d centre = view->Centre(v);
      // Feet stand on the floor, which stays.
      people += std::abs(person.Distance(centre)) < 0.05 && centre.z() > 0.2 ? 1 : 0;
      wall += std::abs(scene.solids[0].Distance(centre)) < 0.05 ? 1 : 0;
    });
  };
  for (size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Isometry3d pose = PoseAt(stations[i]);
    const sensor::Scan scan =
        ScanScene(i == 0 ? peopled : scene, pose, {.noise = 0.003, .seed = i + 1});
    ASSERT_TRUE(model->Insert("scan" + std::to_string(i), scan, pose, serial).ok());
    if (i == 0) count(person_before, wall_before);
  }
  count(person_after, wall_after);
  EXPECT_GT(person_before, 200u);
  EXPECT_LE(person_after, person_before / 20);
  EXPECT_GE(wall_after, wall_before);
}

// Only some of the scans can tell the mirror by themselves; what they know counts for all.
std::vector<PosedScan> ScansOfMirrorRoom() {
  const simulation::Scene scene = simulation::PaneRoom({false, true, true, false});
  const simulation::SimulatedScanner simulated(scene.mesh);
  parallel::Serial serial;
  std::vector<PosedScan> scans;
  const std::vector<Eigen::Vector3d> stations = {{0.5, 3.5, 1.3}, {3.3, 2.1, 1.5}, {4.7, 2.5, 1.3}};
  for (size_t i = 0; i < stations.size(); ++i) {
    PosedScan posed{"scan" + std::to_string(i), {}, PoseAt(stations[i], 0.3)};
    posed.scan.scanner.azimuth_step = posed.scan.scanner.elevation_step = sensor::Radians(0.5);
    posed.scan.image = simulated.Scan(posed.scan.scanner, posed.pose, {}, i + 1, serial);
    scans.push_back(std::move(posed));
  }
  return scans;
}

// Voxels known to be anything more than a voxel outside the room.
size_t ReflectedVoxels(const PlanningView& view) {
  const Eigen::AlignedBox3d room(Eigen::Vector3d(-0.11, -0.11, -0.11),
                                 Eigen::Vector3d(5.31, 4.31, 2.71));
  size_t reflected = 0;
  for (const BrickAt& at : view.bricks()) {
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (at.contents->state[static_cast<size_t>(local)] == VoxelState::kUnknown) continue;
      reflected += room.contains(view.Centre(PlanningView::Global(at.brick, local))) ? 0 : 1;
    }
  }
  return reflected;
}

TEST(MergeTest, AMirrorThatOneScanTellsHasNoReflectionsInAny) {
  const std::vector<PosedScan> scans = ScansOfMirrorRoom();
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  std::vector<size_t> reflected;
  for (const PosedScan& s : scans) {
    ASSERT_TRUE(model->Insert(s.id, s.scan, s.pose, serial).ok());
    reflected.push_back(ReflectedVoxels(*model->Publish()));
  }
  ASSERT_GT(reflected[0], 10'000u) << "the first scan was to be deceived";
  EXPECT_LE(reflected[1], 20u);
  EXPECT_LE(reflected[2], 20u);
}

TEST(MergeTest, ReflectionsComeAndGoWithTheScansThatTellThem) {
  const std::vector<PosedScan> scans = ScansOfMirrorRoom();
  parallel::Serial serial;
  parallel::ThreadPool pool(3);
  const auto model_of = [&](const std::vector<size_t>& order, parallel::Parallel& parallel) {
    auto model = PartialModel::Create({.voxel_size = 0.1}).value();
    for (const size_t i : order) {
      EXPECT_TRUE(model->Insert(scans[i].id, scans[i].scan, scans[i].pose, parallel).ok());
    }
    return model;
  };
  const auto model = model_of({0, 1, 2}, serial);
  const uint64_t all = model->Digest();
  EXPECT_EQ(model_of({1, 2, 0}, pool)->Digest(), all);
  EXPECT_EQ(model_of({2, 0, 1}, serial)->Digest(), all);
  const std::vector<std::vector<size_t>> left = {{1, 2}, {0, 2}, {0, 1}};
  for (size_t gone = 0; gone < scans.size(); ++gone) {
    const PosedScan& s = scans[gone];
    ASSERT_TRUE(model->Withdraw(s.id, serial).ok());
    EXPECT_EQ(model->Digest(), model_of(left[gone], serial)->Digest()) << "without " << gone;
    ASSERT_TRUE(model->Insert(s.id, s.scan, s.pose, serial).ok());
    EXPECT_EQ(model->Digest(), all) << gone << " back again";
  }
}

// A pane that two scans looked at squarely and that never answered is given up; what one scan alone
// missed, and what lies behind something, is not.
TEST(MergeTest, WhatNeverComesIsGivenUp) {
  const ClosedFormScene scene = RoomWithWindow();
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  const std::vector<Eigen::Vector3d> stations = {{0.3, 0.4, 1.5}, {0.5, -0.5, 1.4}};
  std::vector<size_t> given_up;
  for (size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Isometry3d pose = PoseAt(stations[i]);
    ASSERT_TRUE(
        model->Insert("scan" + std::to_string(i), ScanScene(scene, pose, {}), pose, serial).ok());
    size_t count = 0;
    const auto view = model->Publish();
    view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& s) {
      if (!s.given_up) return;
      ++count;
      EXPECT_EQ(state, VoxelState::kFalseHole);
      // Both scans look through it and out of the window, give or take half a voxel.
      for (const Eigen::Vector3d& station : stations) {
        bool out = false;
        for (double dy = -0.03; dy <= 0.03; dy += 0.015) {
          for (double dz = -0.03; dz <= 0.03; dz += 0.015) {
            const Eigen::Vector3d to = view->Centre(v) + Eigen::Vector3d(0, dy, dz) - station;
            out |= scene.Cast(station, to.normalized(), 30) > 20;
          }
        }
        EXPECT_TRUE(out) << view->Centre(v).transpose();
      }
    });
    given_up.push_back(count);
  }
  EXPECT_EQ(given_up[0], 0u);
  EXPECT_GT(given_up[1], 50u);
}

}  // namespace
}  // namespace vantage::model
