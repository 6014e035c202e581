// Scans that are moved: the model is as if they had been merged there in the first place.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

struct MovableScan {
  std::string id;
  sensor::Scan scan;
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d to = Eigen::Isometry3d::Identity();  // off by centimetres
};

class MovableScans {
 public:
  MovableScans(const simulation::Scene& scene, const std::vector<Eigen::Vector3d>& stations,
               const sensor::ScannerModel& scanner, double voxel_size, uint64_t seed)
      : random_(seed) {
    config_.voxel_size = voxel_size;
    const simulation::SimulatedScanner tracer(scene.mesh);
    for (const Eigen::Vector3d& station : stations) {
      const Eigen::Isometry3d pose = PoseAt(station, 0.4 + static_cast<double>(scans_.size()));
      sensor::Scan scan;
      scan.scanner = scanner;
      scan.image = tracer.Scan(scanner, pose, {}, scans_.size() + 1, pool_);
      Add(std::move(scan), pose);
    }
  }
  MovableScans(const ClosedFormScene& scene, size_t count, uint64_t seed) : random_(seed) {
    for (size_t i = 0; i < count; ++i) {
      ScanOptions options;
      options.step = sensor::Radians(1.5);
      options.noise = 0.003;
      options.seed = seed + i;
      const Eigen::Isometry3d pose =
          PoseAt(scene.stations[i % scene.stations.size()], 0.7 * static_cast<double>(i));
      Add(ScanScene(scene, pose, options), pose);
    }
  }

  // Those for which `moved` says so stand where they are moved to.
  template <typename Moved>
  std::unique_ptr<PartialModel> Made(Moved moved) {
    auto model = PartialModel::Create(config_).value();
    for (size_t i = 0; i < scans_.size(); ++i) {
      const MovableScan& scan = scans_[i];
      EXPECT_TRUE(model->Insert(scan.id, scan.scan, moved(i) ? scan.to : scan.at, pool_).ok());
    }
    return model;
  }

  template <typename Moved>
  void Move(PartialModel& model, Moved moved, bool back = false) {
    std::vector<ScanMove> moves;
    for (size_t i = 0; i < scans_.size(); ++i) {
      if (moved(i)) moves.push_back({scans_[i].id, back ? scans_[i].at : scans_[i].to});
    }
    std::shuffle(moves.begin(), moves.end(), random_);
    // One after the other, and two at the same time.
    const size_t at_once = 1 + ++times_moved_ % 2;
    const auto report = model.Move(
        moves, [&](absl::string_view id) { return Find(id); }, pool_,
        std::numeric_limits<int64_t>::max(), at_once);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_GT(report->changed_bricks, 0U);
    EXPECT_EQ(report->version, model.version());
    EXPECT_EQ(model.Publish()->version(), model.version());
  }

  absl::StatusOr<sensor::Scan> Find(absl::string_view id) const {
    for (const MovableScan& scan : scans_) {
      if (scan.id == id) return scan.scan;
    }
    return absl::NotFoundError(id);
  }

  size_t size() const { return scans_.size(); }
  const MovableScan& operator[](size_t i) const { return scans_[i]; }
  parallel::Parallel& pool() { return pool_; }

 private:
  void Add(sensor::Scan scan, const Eigen::Isometry3d& pose) {
    std::normal_distribution<double> off(0, 0.03);
    MovableScan made{"scan" + std::to_string(scans_.size()), std::move(scan), pose, pose};
    made.to.pretranslate(Eigen::Vector3d(off(random_), off(random_), off(random_)));
    made.to.rotate(Eigen::AngleAxisd(0.1 * off(random_), Eigen::Vector3d::UnitZ()));
    scans_.push_back(std::move(made));
  }

  std::mt19937_64 random_;
  ModelConfig config_;
  parallel::ThreadPool pool_{2};
  std::vector<MovableScan> scans_;
  size_t times_moved_ = 0;
};

// Of what planners and exports see, where scanners stood included; and it is what a snapshot keeps.
void ExpectSameModel(MovableScans& scans, const PartialModel& model, const PartialModel& expected) {
  EXPECT_EQ(model.Digest(), expected.Digest());
  const auto view = model.Publish();
  const auto wanted = expected.Publish();
  EXPECT_EQ(view->SurfaceCount(), wanted->SurfaceCount());
  EXPECT_EQ(view->bricks().size(), wanted->bricks().size());
  ASSERT_EQ(view->stations().size(), wanted->stations().size());
  for (size_t i = 0; i < view->stations().size(); ++i) {
    EXPECT_EQ(view->stations()[i].position, wanted->stations()[i].position) << i;
    EXPECT_EQ(view->stations()[i].floor_height, wanted->stations()[i].floor_height) << i;
    EXPECT_EQ(model.PoseOf(scans[i].id)->matrix(), expected.PoseOf(scans[i].id)->matrix());
  }
  const auto loaded =
      PartialModel::Load(model.Save(scans.pool()), size_t{1} << 30, scans.pool()).value();
  EXPECT_EQ(loaded->Digest(), expected.Digest());
}

void ExpectMovesLeaveNoTrace(MovableScans& scans) {
  const auto all = [](size_t) { return true; };
  const auto none = [](size_t) { return false; };
  const auto odd = [](size_t i) { return i % 2 == 1; };
  const std::unique_ptr<PartialModel> before = scans.Made(none);
  const std::unique_ptr<PartialModel> model = scans.Made(none);
  scans.Move(*model, odd);
  ExpectSameModel(scans, *model, *scans.Made(odd));
  scans.Move(*model, all);
  const std::unique_ptr<PartialModel> moved = scans.Made(all);
  EXPECT_NE(moved->Digest(), before->Digest());
  ExpectSameModel(scans, *model, *moved);
  scans.Move(*model, all, true);
  ExpectSameModel(scans, *model, *before);
}

TEST(MoveTest, MovedScansNeverStoodElsewhere) {
  for (uint64_t seed = 1; seed <= test_support::Runs(2u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    MovableScans scans(RandomScene(seed), 3, seed);
    ExpectMovesLeaveNoTrace(scans);
  }
}

TEST(MoveTest, AFewOfManyAreMovedAlone) {
  MovableScans scans(DoorwayRooms(), 9, 5);
  const auto last = [&](size_t i) { return i == 7; };
  const std::unique_ptr<PartialModel> model = scans.Made([](size_t) { return false; });
  scans.Move(*model, last);
  ExpectSameModel(scans, *model, *scans.Made(last));
}

// What a mirror shows is taken out of all scans, wherever these stand.
TEST(MoveTest, ReflectionsAreToldAnew) {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.8);
  MovableScans scans(simulation::PaneRoom({false, true, true, false}),
                     {{0.5, 3.5, 1.3}, {3.3, 2.1, 1.5}, {4.7, 2.5, 1.3}}, scanner, 0.1, 3);
  ExpectMovesLeaveNoTrace(scans);
}

TEST(MoveTest, TheSkyIsClearedAnew) {
  const simulation::Scene street = simulation::StreetScene(1);
  sensor::ScannerModel scanner;
  scanner.range_max = 30;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1.5);
  MovableScans scans(street, {street.starts[0], street.starts[0] + Eigen::Vector3d(1.5, 0, 0)},
                     scanner, 0.15, 4);
  ExpectMovesLeaveNoTrace(scans);
}

TEST(MoveTest, TheOrderOfStationsCanBeTold) {
  MovableScans scans(EmptyRoom(), 3, 2);
  const std::unique_ptr<PartialModel> model = scans.Made([](size_t) { return false; });
  const uint64_t digest = model->Digest();
  ASSERT_TRUE(model->Reorder({scans[2].id, scans[0].id, scans[1].id}).ok());
  EXPECT_EQ(model->Digest(), digest);
  const std::vector<Station> stations = model->Publish()->stations();
  ASSERT_EQ(stations.size(), 3U);
  EXPECT_EQ(stations[0].position, scans[2].at.translation());
  EXPECT_EQ(stations[2].position, scans[1].at.translation());
  EXPECT_TRUE(absl::IsInvalidArgument(model->Reorder({scans[0].id, scans[1].id})));
  EXPECT_TRUE(absl::IsInvalidArgument(model->Reorder({scans[0].id, scans[1].id, "none"})));
}

TEST(MoveTest, WhatIsNotThereCannotBeMoved) {
  MovableScans scans(EmptyRoom(), 2, 1);
  const std::unique_ptr<PartialModel> model = scans.Made([](size_t) { return false; });
  const uint64_t before = model->Digest();
  const std::vector<ScanMove> moves = {{scans[0].id, scans[0].to}, {"none", scans[0].to}};
  const auto load = [&](absl::string_view id) { return scans.Find(id); };
  EXPECT_TRUE(absl::IsNotFound(model->Move(moves, load, scans.pool()).status()));
  EXPECT_EQ(model->Digest(), before);
  const auto lost = [](absl::string_view) -> absl::StatusOr<sensor::Scan> {
    return absl::UnavailableError("the medium is away");
  };
  EXPECT_TRUE(absl::IsUnavailable(
      model->Move(std::vector<ScanMove>{moves[0]}, lost, scans.pool()).status()));
}

}  // namespace
}  // namespace vantage::model
