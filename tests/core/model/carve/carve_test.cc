// What one scan makes of space, against the geometry itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>
#include <unordered_set>

#include "core/model/partial_model.h"
#include "core/model/view/model_config.h"
#include "core/parallel/thread_pool.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/runs.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

constexpr double kVoxel = 0.05;

std::shared_ptr<const PlanningView> ModelOf(const ClosedFormScene& scene,
                                            const ScanOptions& options,
                                            const std::vector<Eigen::Isometry3d>& poses) {
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  int n = 0;
  for (const Eigen::Isometry3d& pose : poses) {
    const auto report =
        model->Insert("scan" + std::to_string(n++), ScanScene(scene, pose, options), pose, serial);
    EXPECT_TRUE(report.ok()) << report.status();
  }
  return model->Publish();
}

template <typename Fn>
void ForEachVoxel(const VoxelBox& box, Fn&& fn) {
  for (int z = box.min.z(); z < box.max.z(); ++z) {
    for (int y = box.min.y(); y < box.max.y(); ++y) {
      for (int x = box.min.x(); x < box.max.x(); ++x) fn(VoxelIndex(x, y, z));
    }
  }
}

const std::vector<VoxelIndex>& Faces() {
  static const std::vector<VoxelIndex> faces = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                                {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  return faces;
}

class CarveSceneTest : public testing::TestWithParam<ClosedFormScene> {};

// The oracle: a voxel is to be empty when its centre is in the scanner's sight, as the scene's own
// geometry says, without any range image.
TEST_P(CarveSceneTest, EmptyIsWhatTheScannerSees) {
  const ClosedFormScene& scene = GetParam();
  const ScanOptions options;
  const Eigen::Vector3d station = scene.stations[0];
  const Eigen::Isometry3d pose = PoseAt(station, 0.3, 0.02, -0.03);  // tilted, as real ones are
  const auto view = ModelOf(scene, options, {pose});
  size_t visible = 0;
  size_t missed = 0;
  size_t invented = 0;
  size_t far_from_surface = 0;
  double deepest = 0;
  ForEachVoxel(view->bounds(), [&](const VoxelIndex& v) {
    const Eigen::Vector3d centre = view->Centre(v);
    const Eigen::Vector3d to = centre - station;
    const double distance = to.norm();
    if (to.head<2>().norm() < 0.5) return;  // the scanner's own station: tested apart
    const Eigen::Vector3d in_scan = pose.linear().transpose() * to;
    const double elevation = std::asin(in_scan.z() / distance);
    // Within a ray's width of the edge of the field of view either answer is right.
    if (std::abs(elevation - options.elevation_min) < options.step) return;
    const double sight = scene.Cast(station, to / distance, 30);
    const bool seen = elevation > options.elevation_min && distance < sight && sight <= 20;
    const bool empty = view->Empty(v);
    if (empty && !scene.InAir(centre)) {
      deepest = std::max(deepest, scene.DistanceToSurface(centre, 1));
    }
    visible += seen ? 1 : 0;
    if (seen == empty) return;
    (seen ? missed : invented)++;
    // An edge hides what lies behind it: there, one ray's width counts as a voxel does.
    bool at_edge = false;
    const Eigen::Vector3d side = to.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d up = side.cross(to).normalized();
    const double width = std::max(kVoxel, distance * options.step);
    for (const double turn : {-1.0, 0.0, 1.0}) {
      for (const double rise : {-1.0, 0.0, 1.0}) {
        const Eigen::Vector3d beside = (to + width * (turn * side + rise * up)).normalized();
        const double range = scene.Cast(station, beside, 30);
        at_edge |= (distance < range && range <= 20) != seen;
        at_edge |= std::abs(range - distance) < kVoxel;
      }
    }
    if (!at_edge && scene.DistanceToSurface(centre, 1) > kVoxel) ++far_from_surface;
  });
  ASSERT_GT(visible, 100'000u);
  EXPECT_LE(static_cast<double>(invented), 0.005 * static_cast<double>(visible));
  // Voxels that hold surface although their centre is visible are right: they are not counted
  // here.
  EXPECT_LE(static_cast<double>(missed), 0.06 * static_cast<double>(visible));
  EXPECT_EQ(far_from_surface, 0u);
  EXPECT_LE(deepest, kVoxel / 2 * 1.74);  // half a voxel's diagonal
}

TEST_P(CarveSceneTest, EmptyNeverTouchesUnknown) {
  const ClosedFormScene& scene = GetParam();
  std::vector<Eigen::Isometry3d> poses;
  for (const Eigen::Vector3d& station : scene.stations) poses.push_back(PoseAt(station, 0.2));
  const auto view = ModelOf(scene, {}, poses);
  size_t leaks = 0;
  ForEachVoxel(view->bounds(), [&](const VoxelIndex& v) {
    if (!view->Empty(v)) return;
    for (const VoxelIndex& face : Faces()) {
      leaks += view->State(v + face) == VoxelState::kUnknown ? 1 : 0;
    }
  });
  EXPECT_EQ(leaks, 0u);
}

// Sparse as real scans are: samples 6 cm apart at 3 m.
TEST_P(CarveSceneTest, WallsAreClosedBetweenSparseSamples) {
  const ClosedFormScene& scene = GetParam();
  ScanOptions options;
  options.step = 0.02;
  options.noise = 0.003;
  const Eigen::Vector3d station = scene.stations[0];
  const auto view = ModelOf(scene, options, {PoseAt(station, 0.1)});
  // Every ray that ends head on at a surface must end in a voxel that is surface.
  size_t rays = 0;
  size_t sieved = 0;
  for (double azimuth = -3; azimuth < 3; azimuth += 0.0313) {
    for (double elevation = -0.9; elevation < 1.4; elevation += 0.0291) {
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double range = scene.Cast(station, direction, 30);
      // Smooth around: no edge within two rays.
      bool smooth = range > 0.7 && range < 6;
      for (const double turn : {-0.045, 0.045}) {
        for (const Eigen::Vector3d& axis :
             {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(direction.unitOrthogonal())}) {
          const double beside = scene.Cast(station, Eigen::AngleAxisd(turn, axis) * direction, 30);
          smooth = smooth && std::abs(beside - range) < 0.12 * range;
        }
      }
      if (!smooth) continue;
      ++rays;
      // No gap: nothing unknown is exposed in front of the wall, and no empty space lies behind.
      bool closed = !view->Empty(view->At(station + (range + 1.5 * kVoxel) * direction));
      for (double t = range - 4 * kVoxel; t < range + 1.5 * kVoxel; t += kVoxel / 8) {
        closed = closed && !IsFalseSurface(view->State(view->At(station + t * direction)));
      }
      sieved += closed ? 0 : 1;
    }
  }
  ASSERT_GT(rays, 3000u);
  EXPECT_LE(sieved, rays / 1000);
}

std::vector<ClosedFormScene> ScenesToCarve() {
  std::vector<ClosedFormScene> scenes = AllScenes();
  scenes.resize(std::max<size_t>(2, test_support::Runs(scenes.size())));
  return scenes;
}
INSTANTIATE_TEST_SUITE_P(Scenes, CarveSceneTest, testing::ValuesIn(ScenesToCarve()),
                         [](const auto& tested) {
                           std::string name = tested.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

// A flood through empty voxels reaches unknown ones only through surface: random scenes and poses.
TEST(CarveTest, FloodsStayInsideTheSurface) {
  for (uint64_t seed = 1; seed <= test_support::Runs(8u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const ClosedFormScene scene = RandomScene(seed);
    std::vector<Eigen::Isometry3d> poses;
    for (const Eigen::Vector3d& station : scene.stations) {
      poses.push_back(PoseAt(station, static_cast<double>(seed), 0.03, -0.02));
    }
    ScanOptions options;
    options.step = sensor::Radians(0.8);
    options.noise = 0.003;
    const auto view = ModelOf(scene, options, poses);
    std::deque<VoxelIndex> queue = {view->At(scene.stations[0])};
    const auto key = [](const VoxelIndex& v) {
      return (static_cast<int64_t>(v.x()) + 4096) * 8192 * 8192 +
             (static_cast<int64_t>(v.y()) + 4096) * 8192 + v.z() + 4096;
    };
    std::unordered_set<int64_t> reached = {key(queue.front())};
    size_t leaks = 0;
    while (!queue.empty()) {
      const VoxelIndex v = queue.front();
      queue.pop_front();
      for (const VoxelIndex& face : Faces()) {
        const VoxelIndex next = v + face;
        const VoxelState state = view->State(next);
        leaks += state == VoxelState::kUnknown ? 1 : 0;
        if (state == VoxelState::kEmpty && reached.insert(key(next)).second) queue.push_back(next);
      }
    }
    EXPECT_EQ(leaks, 0u);
    EXPECT_GT(reached.size(), 50'000u);
  }
}

// What is unknown in the room's air lies along rays that left through its window.
TEST(CarveTest, HolesLieAlongRaysThatLeft) {
  const ClosedFormScene scene = RoomWithWindow();
  const Eigen::Vector3d station = scene.stations[0];
  const auto view = ModelOf(scene, {}, {PoseAt(station)});
  size_t hole = 0;
  view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
    if (state != VoxelState::kFalseHole) return;
    ++hole;
    const Eigen::Vector3d centre = view->Centre(v);
    const Eigen::Vector3d direction = (centre - station).normalized();
    bool out = false;
    for (double dy = -0.03; dy <= 0.03; dy += 0.01) {
      for (double dz = -0.03; dz <= 0.03; dz += 0.01) {
        out |= scene.Cast(station, (direction + Eigen::Vector3d(0, dy, dz)).normalized(), 30) > 20;
      }
    }
    EXPECT_TRUE(out) << centre.transpose();
  });
  EXPECT_GT(hole, 100u);
}

// Nothing drops out and everything is visible but what the pillar hides and what lies below the
// field of view.
TEST(CarveTest, WhatIsHiddenAndWhatLiesBelowTheFieldOfViewAreToldApart) {
  const ClosedFormScene scene = PillarRoom();
  const Eigen::Vector3d station = scene.stations[0];
  const ScanOptions options;
  const auto view = ModelOf(scene, options, {PoseAt(station)});
  size_t image = 0;
  size_t occlusion = 0;
  view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
    EXPECT_NE(state, VoxelState::kFalseHole);
    const Eigen::Vector3d to = view->Centre(v) - station;
    const double elevation = std::asin(to.normalized().z());
    if (state == VoxelState::kFalseImage) {
      ++image;
      EXPECT_LT(elevation, options.elevation_min + options.step);
    } else if (state == VoxelState::kFalseOcclusion) {
      ++occlusion;
      EXPECT_GT(elevation, options.elevation_min - options.step);
    }
  });
  EXPECT_GT(image, 100u);
  EXPECT_GT(occlusion, 100u);
}

TEST(CarveTest, NoInformationIsNotNoReturn) {
  const ClosedFormScene scene = EmptyRoom();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0]);
  for (const float value : {sensor::RangeImage::kNoReturn, sensor::RangeImage::kNoInformation}) {
    sensor::Scan scan = ScanScene(scene, pose, {});
    for (int c = 100; c < 160; ++c) {
      for (int r = 120; r < 200; ++r) scan.image.range[scan.image.Index(c, r)] = value;
    }
    parallel::Serial serial;
    auto model = PartialModel::Create({}).value();
    ASSERT_TRUE(model->Insert("a", scan, pose, serial).ok());
    size_t hole = 0;
    size_t image_above_horizon = 0;
    const auto view = model->Publish();
    view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
      hole += state == VoxelState::kFalseHole ? 1 : 0;
      const bool above = view->Centre(v).z() > pose.translation().z();
      image_above_horizon += state == VoxelState::kFalseImage && above ? 1 : 0;
    });
    const bool no_return = value == sensor::RangeImage::kNoReturn;
    EXPECT_EQ(hole > 50, no_return);
    EXPECT_EQ(image_above_horizon > 50, !no_return);
  }
}

// Lone rays that did not come back, among many that did, make no veils around the scanner.
TEST(CarveTest, ScatteredDropOutsLeaveNoHolesNearTheScanner) {
  const ClosedFormScene scene = EmptyRoom();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0]);
  sensor::Scan scan = ScanScene(scene, pose, {.step = sensor::Radians(0.25)});
  std::mt19937_64 random(3);
  for (float& range : scan.image.range) {
    if (random() % 10 == 0) range = sensor::RangeImage::kNoReturn;
  }
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  ASSERT_TRUE(model->Insert("a", scan, pose, serial).ok());
  const auto view = model->Publish();
  size_t holes = 0;
  view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
    const double distance = (view->Centre(v) - pose.translation()).norm();
    holes += state == VoxelState::kFalseHole && distance < 1.5 ? 1 : 0;
  });
  EXPECT_EQ(holes, 0u);
}

// Rays that tell nothing and stand alone cut no hairs into what the rays around them crossed,
// however far away: neither a drop-out nor a mixed pixel at the edge of something near.
TEST(CarveTest, LoneRaysGrowNoVeilsFarAway) {
  ClosedFormScene scene = EmptyRoom();
  scene.air = {{Eigen::Vector3d(-9.02, -3.01, 0.02), Eigen::Vector3d(9.03, 3.02, 2.81)}};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(5, -1, -1), Eigen::Vector3d(6, 1, 1.2));
  scene.solids.push_back({box.center(), box.sizes() / 2});
  const Eigen::Isometry3d pose = PoseAt({-1, 0.1, 1.5}, 0.1, 0.01, 0.02);
  for (const bool mixed : {false, true}) {
    sensor::Scan scan = ScanScene(scene, pose, {.noise = 0.003});
    const sensor::RangeImage clean = scan.image;
    size_t lone = 0;
    for (int c = 1; c + 1 < clean.columns(); ++c) {
      for (int r = 1; r + 1 < clean.rows(); ++r) {
        float& range = scan.image.range[clean.Index(c, r)];
        const float before = clean.at(c - 1, r);
        if (!mixed && c % 5 == 2 && r % 5 == 2) {
          range = sensor::RangeImage::kNoReturn;
          ++lone;
        } else if (mixed && before < clean.at(c, r) - 1) {
          range = 0.6f * before + 0.4f * range;  // the beam meets the edge that ends to the left
          ++lone;
        }
      }
    }
    ASSERT_GT(lone, 20u);
    parallel::Serial serial;
    auto model = PartialModel::Create({}).value();
    ASSERT_TRUE(model->Insert("a", scan, pose, serial).ok());
    const auto view = model->Publish();
    size_t veils = 0;
    view->ForEachSurface([&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel&) {
      if (!IsFalseSurface(state)) return;
      const Eigen::Vector3d to = view->Centre(v) - pose.translation();
      // Before everything, well inside the field of view.
      const bool inside = std::asin(to.normalized().z()) > sensor::Radians(-55);
      veils += inside && view->Centre(v).x() < box.min().x() - 0.1 &&
                       scene.DistanceToSurface(view->Centre(v), 1) > 2 * kVoxel
                   ? 1
                   : 0;
    });
    EXPECT_EQ(veils, 0u) << (mixed ? "mixed pixels" : "drop-outs");
  }
}

TEST(CarveTest, AScannersOwnStationIsFree) {
  for (const ClosedFormScene& scene : {EmptyRoom(), BoxInRoom(), DoorwayRooms()}) {
    const Eigen::Vector3d station = scene.stations[0];
    const auto view = ModelOf(scene, {}, {PoseAt(station, 1.0, 0.02, 0.02)});
    ASSERT_EQ(view->stations().size(), 1u);
    const Station& found = view->stations()[0];
    EXPECT_TRUE(found.floor_found);
    EXPECT_NEAR(found.floor_height, scene.air[0].min().z(), 0.01);
    const int floor = static_cast<int>(std::floor(found.floor_height / kVoxel));
    for (double x = -0.3; x <= 0.3; x += 0.1) {
      for (double y = -0.15; y <= 0.15; y += 0.05) {
        const VoxelIndex foot = view->At({station.x() + x, station.y() + y, found.floor_height});
        for (int z = floor + 1; z * kVoxel < station.z(); ++z) {
          EXPECT_TRUE(view->Empty({foot.x(), foot.y(), z})) << x << " " << y << " " << z;
        }
        EXPECT_EQ(view->State(foot), VoxelState::kTrueSurface);
        const std::optional<SurfaceVoxel> laid = view->Surface(foot);
        ASSERT_TRUE(laid.has_value());
        EXPECT_EQ(laid->density, 0);  // nobody measured it
      }
    }
  }
}

// No level is the ground of a slope: it lies above it or below, and what is cleared over it is dug
// into the slope.
TEST(CarveTest, AStationOnASlopeStandsOnIt) {
  for (const double rise : {0.0, 0.08, 0.15, 0.3}) {
    SCOPED_TRACE(rise);
    const auto ground = [&](double x, double y) { return 0.3 + rise * (0.6 * x + 0.8 * y); };
    const Eigen::Vector3d station(1.0, 0.5, ground(1.0, 0.5) + 1.6);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(station);
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
    const sensor::Scan scan = test_support::ScanBy(
        scanner, pose, 3, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
          const double down = rise * (0.6 * ray.x() + 0.8 * ray.y()) - ray.z();
          return down > 0 ? (from.z() - ground(from.x(), from.y())) / down : 0;
        });
    parallel::Serial serial;
    auto model = PartialModel::Create({}).value();
    ASSERT_TRUE(model->Insert("scan", scan, pose, serial).ok());
    const auto view = model->Publish();
    const Station& found = view->stations()[0];
    ASSERT_TRUE(found.floor_found);
    EXPECT_NEAR(found.floor_height, ground(1.0, 0.5), 0.02);
    // As far as it is cleared, and a voxel.
    const double reach = scanner.clearance + kVoxel;
    size_t laid = 0;
    for (double x = -reach; x <= reach; x += kVoxel) {
      for (double y = -reach; y <= reach; y += kVoxel) {
        const double height = ground(station.x() + x, station.y() + y);
        const VoxelIndex foot = view->At({station.x() + x, station.y() + y, height});
        for (int z = foot.z() - 12; view->Centre({0, 0, z}).z() < height - kVoxel; ++z) {
          EXPECT_FALSE(view->Empty({foot.x(), foot.y(), z})) << x << " " << y << " " << z;
        }
        for (const int z : {-1, 0, 1}) {
          laid += view->State(foot + VoxelIndex(0, 0, z)) == VoxelState::kTrueSurface ? 1 : 0;
        }
      }
    }
    EXPECT_GT(laid, 50u);
  }
}

TEST(CarveTest, AStationOnAPlinthDoesNotStandOnTheFloorAroundIt) {
  // The blind cone hides the plinth from its own station, and the floor beyond it is all that the
  // scan has of floors. Higher ones show a rim of themselves.
  for (const double height : {0.8, 1.2, 2.0}) {
    for (const double half : {0.5, 0.8, 1.4}) {
      SCOPED_TRACE(testing::Message() << height << " m high, " << 2 * half << " m wide");
      ClosedFormScene scene;
      scene.air.emplace_back(Eigen::Vector3d(-5, -4, 0), Eigen::Vector3d(5, 4, 5));
      scene.solids.push_back({{1, 0.5, 0.5 * height}, {half, half, 0.5 * height}});
      const Eigen::Vector3d station(1, 0.5, height + 1.5);
      const auto view = ModelOf(scene, {}, {PoseAt(station, 0.4, 0.02, -0.02)});
      ASSERT_EQ(view->stations().size(), 1u);
      const Station& found = view->stations()[0];
      if (found.floor_found) {
        EXPECT_NEAR(found.floor_height, height, 0.02);
      }
      // Nothing within the plinth is empty.
      const VoxelIndex low = view->At({1 - half + 0.1, 0.5 - half + 0.1, 0.1});
      const VoxelIndex high = view->At({1 + half - 0.1, 0.5 + half - 0.1, height - 0.1});
      ForEachVoxel({low, high}, [&](const VoxelIndex& v) {
        EXPECT_FALSE(view->Empty(v)) << view->Centre(v).transpose();
      });
    }
  }
}

TEST(CarveTest, RefusesWhatItCannotModel) {
  parallel::Serial serial;
  auto model = PartialModel::Create({}).value();
  const ClosedFormScene scene = EmptyRoom();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0]);
  const sensor::Scan scan = ScanScene(scene, pose, {});
  ASSERT_TRUE(model->Insert("a", scan, pose, serial).ok());
  const uint64_t digest = model->Digest();

  EXPECT_EQ(model->Insert("a", scan, pose, serial).status().code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(model->Insert("b", scan, PoseAt({300, 0, 0}), serial).status().code(),
            absl::StatusCode::kOutOfRange);
  Eigen::Isometry3d stretched = pose;
  stretched.linear() *= 1.1;
  EXPECT_EQ(model->Insert("b", scan, stretched, serial).status().code(),
            absl::StatusCode::kInvalidArgument);
  sensor::Scan broken = scan;
  broken.image.range[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(model->Insert("b", broken, pose, serial).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(model->Withdraw("b", serial).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(model->Digest(), digest);

  ModelConfig config;
  config.voxel_size = 0;
  EXPECT_EQ(PartialModel::Create(config).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace vantage::model
