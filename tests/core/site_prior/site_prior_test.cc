// Priors of furnished flats, against scans of them: what is aligned where, what is refuted, and
// what planning makes of it.
#include "core/site_prior/site_prior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/site_prior/mesh_samples.h"
#include "core/site_prior/prior_space.h"
#include "core/site_prior/refutation.h"
#include "core/site_prior/walls.h"

namespace vantage::site_prior {
namespace {

using testing::HasSubstr;

parallel::Budget Rays(uint64_t rays) {
  parallel::Budget budget = parallel::Budget::Unlimited();
  budget.work_limit = rays;
  return budget;
}

sensor::ScannerModel Coarse() {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  return scanner;
}

// A model of a scene whose frame is the scene's.
class ScannedScene {
 public:
  explicit ScannedScene(simulation::Scene scene)
      : scene_(std::move(scene)),
        tracer_(scene_.mesh),
        model_(model::PartialModel::Create({}).value()) {
    view_ = model_->Publish();
  }
  void ScanFrom(const Eigen::Vector3d& place) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = place;
    sensor::Scan scan;
    scan.scanner = Coarse();
    scan.image = tracer_.Scan(scan.scanner, pose, simulation::ScanFaults{}, 1 + scans_, pool_);
    ASSERT_TRUE(model_->Insert("scan" + std::to_string(++scans_), scan, pose, pool_).ok());
    view_ = model_->Publish();
  }
  const simulation::Scene& scene() const { return scene_; }
  const model::PlanningView& model() const { return *view_; }
  parallel::Parallel& pool() { return pool_; }

 private:
  simulation::Scene scene_;
  simulation::SimulatedScanner tracer_;
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  uint64_t scans_ = 0;
};

PriorMesh MeshOf(const simulation::Scene& scene, float scale = 1) {
  PriorMesh mesh{scene.mesh.vertices, scene.mesh.triangles};
  for (Eigen::Vector3f& vertex : mesh.vertices) vertex *= scale;
  return mesh;
}

PriorMesh HalfTurned(PriorMesh mesh) {
  const Eigen::Vector3f middle = mesh.Bounds().center();
  for (Eigen::Vector3f& vertex : mesh.vertices) {
    vertex.head<2>() = 2 * middle.head<2>() - vertex.head<2>();
  }
  return mesh;
}

absl::StatusOr<PriorStanding> JudgeAt(const model::PlanningView& model, PriorMesh mesh,
                                      const PriorPose& placement) {
  const auto prior = SitePrior::Create(std::move(mesh), placement);
  if (!prior.ok()) return prior.status();
  return Judge(model, **prior);
}

// A placement that is off by 1.1 m, 6 degrees and 0.2 m in height.
PriorPose Rough() {
  PriorPose pose;
  pose.translation = {0.9, -0.6, 0.2};
  pose.yaw = 0.1;
  return pose;
}

double Off(const PriorPose& pose, double scale, const Eigen::Vector3d& at) {
  return (pose.ToModel(scale * at) - at).norm();
}

class FlatPriorTest : public ::testing::TestWithParam<int> {
 protected:
  ScannedScene flat_{simulation::FurnishedFlat(static_cast<uint64_t>(GetParam()))};
};

TEST_P(FlatPriorTest, ATrueOneIsAlignedByTheFirstScanWithItsScale) {
  flat_.ScanFrom(flat_.scene().starts[0]);
  const auto standing = JudgeAt(flat_.model(), MeshOf(flat_.scene(), 1.02F), Rough());
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_EQ(standing->state, PriorState::kAligned) << standing->message;
  EXPECT_NEAR(standing->alignment.pose.scale, 1 / 1.02, 0.006);
  EXPECT_LT(Off(standing->alignment.pose, 1.02, flat_.scene().starts[0]), 0.06);
  EXPECT_LT(standing->refuted_share, 0.1);
  EXPECT_TRUE(standing->used());
}

TEST_P(FlatPriorTest, AWrongOneIsNotUsed) {
  flat_.ScanFrom(flat_.scene().starts[0]);
  // Not another flat: some have the same walls, and are right to be used.
  const simulation::Scene other = simulation::PillarHall(static_cast<uint64_t>(GetParam()));
  for (const PriorMesh& mesh : {HalfTurned(MeshOf(flat_.scene())), MeshOf(other)}) {
    const auto standing = JudgeAt(flat_.model(), mesh, Rough());
    ASSERT_TRUE(standing.ok()) << standing.status();
    EXPECT_FALSE(standing->used()) << standing->message;
  }
}

INSTANTIATE_TEST_SUITE_P(Flats, FlatPriorTest, testing::Range(101, 109));

TEST(SitePriorTest, IsExpectedWhereItWasPlacedBeforeTheFirstScan) {
  ScannedScene rooms(simulation::TwoRooms(1));
  const auto standing = JudgeAt(rooms.model(), MeshOf(rooms.scene()), {});
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_TRUE(standing->used());
  EXPECT_EQ(standing->state, PriorState::kPlaced);
  const auto site = planning::ExpectedSite::Of(*standing->space);
  ASSERT_TRUE(site.ok());
  EXPECT_FALSE((*site)->floors().empty());
  planning::PlanningConfig config;
  config.station_basis = planning::StationBasis::kExpected;
  const auto problem = planning::PlanningProblem::Prepare(
      {rooms.model(), Coarse(), config, nullptr, *site}, rooms.pool());
  ASSERT_TRUE(problem.ok()) << problem.status();
  EXPECT_GT((*problem)->feasible().cells().size(), 100u);
  const planning::Plan plan =
      planning::MakePlan(**problem, Rays(2'000'000), rooms.pool(), [](const planning::Plan&) {});
  ASSERT_FALSE(plan.views.empty()) << plan.message;
  EXPECT_TRUE(plan.views[0].expected.has_value());
  EXPECT_TRUE(plan.views[0].expected->by_site_prior);
  EXPECT_GT(plan.views[0].expected_gain, 5);
  EXPECT_EQ(plan.views[0].model_gain, 0);
  // With what is known alone there is nowhere to stand.
  config.station_basis = planning::StationBasis::kKnown;
  const auto known = planning::PlanningProblem::Prepare(
      {rooms.model(), Coarse(), config, nullptr, *site}, rooms.pool());
  ASSERT_TRUE(known.ok()) << known.status();
  EXPECT_TRUE((*known)->feasible().cells().empty());
}

// What its own mesh shows of a scene that was scanned; null where it is not used.
std::shared_ptr<const planning::ExpectedSite> ShownOf(ScannedScene& rooms) {
  const auto standing = JudgeAt(rooms.model(), MeshOf(rooms.scene()), {});
  if (!standing.ok() || !standing->used()) return nullptr;
  return planning::ExpectedSite::Of(*standing->space).value();
}

// What lies beside measured surface goes on there, however near; what lies before or behind it is
// the same, a little off.
TEST(SitePriorTest, IsExpectedBesideWhatWasMeasured) {
  ScannedScene rooms(simulation::TwoRooms(1));
  rooms.ScanFrom(rooms.scene().starts[0]);
  const auto standing = JudgeAt(rooms.model(), MeshOf(rooms.scene()), {});
  ASSERT_TRUE(standing.ok() && standing->used()) << standing.status();
  const auto measured_alike = [&](const model::VoxelIndex& at, const Eigen::Vector3f& normal) {
    return rooms.model().State(at) == model::VoxelState::kTrueSurface &&
           rooms.model().Surface(at)->normal.dot(normal) > 0.9F;
  };
  size_t beside = 0;
  size_t before_or_behind = 0;
  standing->space->ForEachSurface([&](const model::VoxelIndex& v, model::VoxelState /*state*/,
                                      const model::SurfaceVoxel& surface) {
    if (rooms.model().State(v) != model::VoxelState::kUnknown) return;
    int axis = 0;
    if (surface.normal.cwiseAbs().maxCoeff(&axis) < 0.99F) return;
    for (int off = -3; off <= 3; ++off) {
      for (int other = 0; other < 3; ++other) {
        model::VoxelIndex at = v;
        at[other] += off;
        if (!measured_alike(at, surface.normal)) continue;
        ++(other == axis ? before_or_behind : beside);
      }
    }
  });
  EXPECT_GT(beside, 300u);
  EXPECT_EQ(before_or_behind, 0u);
}

// A pane of glass is in a prior like all else, and no scan will ever show it.
TEST(SitePriorTest, IsNotExpectedWhereAScanLookedAndShowedNothing) {
  simulation::Scene scene = simulation::TwoRooms(1);
  const Eigen::Vector3f start = scene.starts[0].cast<float>();
  const auto first = static_cast<uint32_t>(scene.mesh.vertices.size());
  for (const Eigen::Vector2f& corner : {Eigen::Vector2f(-0.5F, 1.0F), Eigen::Vector2f(-0.5F, 2.0F),
                                        Eigen::Vector2f(0.5F, 2.0F), Eigen::Vector2f(0.5F, 1.0F)}) {
    scene.mesh.vertices.emplace_back(start.x() + 0.8F, start.y() + corner.x(), corner.y());
  }
  scene.mesh.triangles.push_back({first, first + 1, first + 2});
  scene.mesh.triangles.push_back({first, first + 2, first + 3});
  scene.mesh.material.resize(scene.mesh.triangles.size(), simulation::Material::kGlass);
  ScannedScene rooms(scene);
  rooms.ScanFrom(scene.starts[0]);
  const auto site = ShownOf(rooms);
  ASSERT_NE(site, nullptr);
  planning::PlanningConfig config;
  config.required_density = 300;
  config.station_basis = planning::StationBasis::kExpected;
  const auto problem = planning::PlanningProblem::Prepare(
      {rooms.model(), Coarse(), config, nullptr, site}, rooms.pool());
  ASSERT_TRUE(problem.ok()) << problem.status();
  const auto expected_from = [&](const Eigen::Vector3d& place) {
    const planning::Scoring& scoring = (*problem)->scoring();
    std::vector<float> scores(scoring.cells().size());
    scoring.scorer().ScoreCells(place, scoring.cells(), parallel::Budget::Unlimited(), scores);
    double area = 0;
    for (size_t i = 0; i < scores.size(); ++i) {
      const planning::DeficientCell cell = (*problem)->patches().cells[scoring.cells().cell[i]];
      if (cell.expected && scores[i] > 0) area += static_cast<double>(cell.area);
    }
    return area;
  };
  EXPECT_LT(expected_from(scene.starts[0]), 0.1);
  // The other room was not looked at.
  EXPECT_GT(expected_from(scene.starts.back()), 10);
}

TEST(SitePriorTest, MakesNothingRegister) {
  ScannedScene rooms(simulation::TwoRooms(1));
  rooms.ScanFrom(rooms.scene().starts[0]);
  const auto site = ShownOf(rooms);
  ASSERT_NE(site, nullptr);
  planning::PlanningConfig config;
  config.station_basis = planning::StationBasis::kExpected;
  const auto with = planning::PlanningProblem::Prepare(
      {rooms.model(), Coarse(), config, nullptr, site}, rooms.pool());
  const auto without =
      planning::PlanningProblem::Prepare({rooms.model(), Coarse(), config}, rooms.pool());
  ASSERT_TRUE(with.ok() && without.ok());
  // What views are judged by was measured.
  const planning::CellArrays& judged = (*with)->overlap().cells();
  ASSERT_GT(judged.size(), 1000u);
  for (size_t i = 0; i < judged.size(); ++i) {
    const Eigen::Vector3f at(judged.x[i], judged.y[i], judged.z[i]);
    const model::VoxelIndex v = rooms.model().At(at.cast<double>());
    // The mean of samples may lie in a voxel beside.
    const model::VoxelState state = rooms.model().State(v);
    ASSERT_TRUE(state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed)
        << at.transpose();
  }
  // It says more where nothing is known, and the same where something is.
  size_t more = 0;
  for (const model::BrickAt& at : (*with)->view().bricks()) {
    for (int local = 0; local < model::Brick::kVoxels; ++local) {
      const model::VoxelIndex v = model::PlanningView::Global(at.brick, local);
      const model::VoxelState known = rooms.model().State(v);
      const bool nothing = known == model::VoxelState::kUnknown || model::IsFalseSurface(known);
      if (nothing) {
        more += (*with)->view().State(v) != known ? 1 : 0;
      } else {
        ASSERT_EQ((*with)->view().State(v), known);
      }
    }
  }
  EXPECT_GT(more, 1000u);
  // Behind the door the room is expected as far as it goes, where without a prior some room is that
  // reaches into walls.
  const auto there = SpaceOf(MeshOf(rooms.scene()), {}, rooms.model().voxel_size());
  ASSERT_TRUE(there.ok());
  const auto in_walls = [&](const planning::PlanningProblem& problem) {
    size_t count = 0;
    for (size_t i = 0; i < problem.feasible().cells().size(); ++i) {
      count += there->Empty(there->At(problem.feasible().Centre(i))) ? 0 : 1;
    }
    return count;
  };
  EXPECT_EQ(in_walls(**with), 0u);
  EXPECT_GT(in_walls(**without), 100u);
}

// What is behind false surface the prior says: no view is worth more for what may be there.
TEST(SitePriorTest, LeavesNoRoomToBeDiscovered) {
  ScannedScene rooms(simulation::TwoRooms(1));
  rooms.ScanFrom(rooms.scene().starts[0]);
  const auto site = ShownOf(rooms);
  ASSERT_NE(site, nullptr);
  planning::PlanningConfig config;
  config.station_basis = planning::StationBasis::kExpected;
  const auto deep = [&](std::shared_ptr<const planning::ExpectedSite> shown) {
    const auto problem = planning::PlanningProblem::Prepare(
        {rooms.model(), Coarse(), config, nullptr, std::move(shown)}, rooms.pool());
    size_t count = 0;
    for (const planning::DeficientCell& cell : (*problem)->patches().cells) {
      count += cell.enough > cell.required ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(deep(site), 0u);
  EXPECT_GT(deep(nullptr), 100u);
  // Of a building 50 m away it says nothing here, and of a storey above neither.
  for (const Eigen::Vector3f& away : {Eigen::Vector3f(50, 0, 0), Eigen::Vector3f(0, 0, 9)}) {
    simulation::Scene other = simulation::TwoRooms(1);
    for (Eigen::Vector3f& vertex : other.mesh.vertices) vertex += away;
    ScannedScene elsewhere(other);
    elsewhere.ScanFrom(other.starts[0] + away.cast<double>());
    const model::PlanningView& model = elsewhere.model();
    const auto there =
        planning::ExpectedSite::Of(model::PlanningView(model, model.version(), {}, {}));
    EXPECT_EQ(deep(*there), deep(nullptr));
  }
}

TEST(SitePriorTest, IsRefutedWhereAWallIsGone) {
  ScannedScene rooms(simulation::TwoRooms(1));
  rooms.ScanFrom(rooms.scene().starts[0]);
  // A wall through the middle of the room that was scanned.
  const Eigen::Vector3d start = rooms.scene().starts[0];
  PriorMesh mesh = MeshOf(rooms.scene());
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const auto x = static_cast<float>(start.x() + 0.8);
  const auto y = static_cast<float>(start.y());
  mesh.vertices.insert(
      mesh.vertices.end(),
      {{x, y - 0.5F, 0}, {x, y + 0.5F, 0}, {x, y + 0.5F, 2.4F}, {x, y - 0.5F, 2.4F}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  const auto standing = JudgeAt(rooms.model(), mesh, {});
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_EQ(standing->state, PriorState::kAligned) << standing->message;
  EXPECT_GT(standing->gone_area, 0.2);
  EXPECT_THAT(standing->message, HasSubstr("gone"));
  const Eigen::Vector3d wall(x, y, 1.2);
  EXPECT_EQ(standing->space->State(rooms.model().At(wall)), model::VoxelState::kUnknown);
}

// The door between two rooms was closed by a wall since: nothing is expected behind it.
TEST(SitePriorTest, IsRefutedBehindANewWall) {
  simulation::Scene scene = simulation::TwoRooms(1);
  const PriorMesh prior = MeshOf(scene);
  ASSERT_FALSE(scene.doorways.empty());
  const simulation::SceneDoorway& door = scene.doorways.front();
  const auto first = static_cast<uint32_t>(scene.mesh.vertices.size());
  const Eigen::Vector2d half = door.along * (door.width / 2 + 0.1);
  for (const double z : {0.0, 2.4}) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d p = door.middle + side * half;
      scene.mesh.vertices.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                       static_cast<float>(z));
    }
  }
  scene.mesh.triangles.push_back({first, first + 1, first + 3});
  scene.mesh.triangles.push_back({first, first + 3, first + 2});
  scene.mesh.material.resize(scene.mesh.triangles.size(), simulation::Material::kMatte);
  const Eigen::Vector3d there = scene.starts.back();
  ScannedScene open(simulation::TwoRooms(1));
  ScannedScene closed(scene);
  for (ScannedScene* rooms : {&open, &closed}) rooms->ScanFrom(scene.starts.front());
  const auto as_it_was = JudgeAt(open.model(), prior, {});
  const auto walled = JudgeAt(closed.model(), prior, {});
  ASSERT_TRUE(as_it_was.ok() && as_it_was->used());
  ASSERT_TRUE(walled.ok() && walled->used()) << walled.status();
  EXPECT_TRUE(as_it_was->space->Empty(open.model().At(there)));
  EXPECT_FALSE(walled->space->Empty(closed.model().At(there))) << walled->message;
}

TEST(SitePriorTest, SaysThatTheUnitIsWrongByTheTwoPoints) {
  const auto metres = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0}}, {{5000, 0, 0}, {1, 6, 0}}}});
  EXPECT_EQ(metres.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(metres.status().message(), HasSubstr("give the unit, mm"));
  const auto near = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0}}, {{0.2, 0, 0}, {1.2, 1, 0}}}});
  EXPECT_THAT(near.status().message(), HasSubstr("far ends"));
  // Near each other at one of both alone: within what points are off, and beyond it.
  const auto at_site = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0}}, {{1.6, 0, 0}, {1.8, 1, 0}}}});
  EXPECT_THAT(at_site.status().message(), HasSubstr("0.80 m apart: take two"));
  const auto in_prior = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0}}, {{0.8, 0, 0}, {2.6, 1, 0}}}});
  EXPECT_THAT(in_prior.status().message(), HasSubstr("0.80 m apart: take two"));
  const auto contradict = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0}}, {{0.8, 0, 0}, {9, 1, 0}}}});
  EXPECT_THAT(contradict.status().message(), HasSubstr("in the prior and 8.00 m at the site"));
  const auto fine = PlaceByPoints({{{{0, 0, 0}, {1, 1, 0.5}}, {{5, 0, 0}, {1, 6, 0.5}}}});
  ASSERT_TRUE(fine.ok());
  EXPECT_NEAR(fine->yaw, std::numbers::pi / 2, 1e-9);
  EXPECT_LT((fine->ToModel({5, 0, 0}) - Eigen::Vector3d(1, 6, 0.5)).norm(), 1e-9);
  EXPECT_LT((fine->ToPrior(fine->ToModel({5, 2, 1})) - Eigen::Vector3d(5, 2, 1)).norm(), 1e-9);
}

TEST(SitePriorTest, IsGivenUpOnTheWay) {
  ScannedScene rooms(simulation::TwoRooms(1));
  std::stop_source stop;
  stop.request_stop();
  const parallel::Cancellation cancelled(stop.get_token());
  const auto none = SitePrior::Create(MeshOf(rooms.scene()), {}, kDefaultAccuracy, cancelled);
  EXPECT_EQ(none.status().code(), absl::StatusCode::kCancelled);
  const auto space = SpaceOf(MeshOf(rooms.scene()), {}, 0.05);
  ASSERT_TRUE(space.ok());
  EXPECT_EQ(Refute(rooms.model(), *space, 0.1, cancelled).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_THAT(SitePrior::Create(MeshOf(rooms.scene()), {}, 0.31).status().message(),
              HasSubstr("accuracy_m: in (0, 0.3]"));
}

TEST(SitePriorTest, HasNoRoomWhereItLiesOnItsSide) {
  ScannedScene rooms(simulation::TwoRooms(1));
  PriorMesh wall;
  wall.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 0, 3}, {0, 0, 3}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto standing = JudgeAt(rooms.model(), wall, {});
  EXPECT_EQ(standing.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(standing.status().message(), HasSubstr("no room"));
}

// Half of the walls of a flat that is turned lie on those of another place in it, wherever it is
// put; once a room was seen that is a verdict, and not something to wait for.
TEST(SitePriorTest, IsNotAlignedWhereNoPlaceOfSeveralAgrees) {
  ScannedScene flat(simulation::FurnishedFlat(3));
  const PriorMesh turned = HalfTurned(MeshOf(flat.scene()));
  bool decided = false;
  for (const Eigen::Vector3d& start : flat.scene().starts) {
    flat.ScanFrom(start);
    const auto standing = JudgeAt(flat.model(), turned, Rough());
    ASSERT_TRUE(standing.ok()) << standing.status();
    EXPECT_FALSE(standing->used());
    if (standing->alignment.wall_area < 25) continue;
    decided = true;
    EXPECT_EQ(standing->state, PriorState::kNotAligned) << standing->message;
    EXPECT_THAT(standing->message, HasSubstr("place it anew, or give another one"));
  }
  EXPECT_TRUE(decided);
}

// A stated scale is that of heights, too: a prior of twice the size lies 1.5 m of the site off.
TEST(SitePriorTest, IsSoughtInMetresOfTheSite) {
  ScannedScene flat(simulation::FurnishedFlat(101));
  flat.ScanFrom(flat.scene().starts[0]);
  PriorPose placement = Rough();
  placement.translation.z() = 1.5;
  placement.scale = 0.5;
  const auto standing = JudgeAt(flat.model(), MeshOf(flat.scene(), 2), placement);
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_EQ(standing->state, PriorState::kAligned) << standing->message;
  EXPECT_NEAR(standing->alignment.pose.scale, 0.5, 0.003);
  EXPECT_LT(Off(standing->alignment.pose, 2, flat.scene().starts[0]), 0.06);
}

TEST(SitePriorTest, SaysThatItCannotBeHadInTheModelsVoxels) {
  PriorMesh hall;
  hall.vertices = {{0, 0, 0}, {32, 0, 0}, {32, 32, 0}, {0, 32, 0},
                   {0, 0, 3}, {32, 0, 3}, {32, 32, 3}, {0, 32, 3}};
  hall.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  const auto prior = SitePrior::Create(hall, {});
  ASSERT_TRUE(prior.ok()) << prior.status();
  EXPECT_TRUE(CheckUsable(**prior, 0.05).ok());
  const absl::Status fine = CheckUsable(**prior, 0.02);
  EXPECT_EQ(fine.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(fine.message(), HasSubstr("in voxels of 0.02 m"));
  const auto standing = Judge(model::PlanningView(0.02, 0, {}, {}), **prior);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->state, PriorState::kUnusable);
  EXPECT_FALSE(standing->used());
  EXPECT_THAT(standing->message, HasSubstr("give the part that is to be scanned"));
}

TEST(SitePriorTest, BuildsNoMeshOfAModelThatIsTooLarge) {
  ScannedScene rooms(simulation::TwoRooms(1));
  rooms.ScanFrom(rooms.scene().starts[0]);
  const auto mesh = MeshOfModel(rooms.model());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(MeshOfModel(rooms.model(), mesh->triangles.size()).ok());
  const absl::Status large = MeshOfModel(rooms.model(), mesh->triangles.size() - 2).status();
  EXPECT_EQ(large.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(large.message(), HasSubstr("voxels of surface, more than"));
}

TEST(SitePriorTest, KnowsTheFloorThatAPlaceLiesOver) {
  std::vector<model::Station> stations(3);
  stations[0].floor_height = 2.8;
  stations[1].floor_height = 0;
  stations[2].floor_height = 2.8;
  const Floors floors(model::PlanningView(0.05, 1, {}, stations));
  EXPECT_FALSE(floors.Under(-0.4).has_value());
  EXPECT_EQ(floors.Under(-0.2), 0.0);
  EXPECT_EQ(floors.Under(2.4), 0.0);
  EXPECT_EQ(floors.Under(2.6), 2.8);
  EXPECT_EQ(floors.Under(9), 2.8);
}

}  // namespace
}  // namespace vantage::site_prior
