#include "core/visibility/occlusion_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <iostream>
#include <random>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"
#include "core/visibility/target.h"
#include "core/visibility/voxel_walk.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/runs.h"

namespace vantage::visibility {
namespace {

// Rubble: every voxel solid or empty at random, in blobs.
model::PlanningView Rubble(uint64_t seed, double solid_share) {
  test_support::ClosedFormScene scene;
  scene.voxel = 0.1;
  scene.extent =
      Eigen::AlignedBox3d(Eigen::Vector3d(-1.7, -1.3, -0.9), Eigen::Vector3d(6, 1.9, 1.5));
  scene.solid = [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3i v = (p / 0.1).array().floor().cast<int>();
    const auto hash = static_cast<uint64_t>((v.x() >> 1) * 73856093 ^ (v.y() >> 1) * 19349663 ^
                                            v.z() * 83492791) +
                      seed;
    std::mt19937_64 random(hash);
    random.discard(3);
    return static_cast<double>(random() >> 11) * 0x1.0p-53 < solid_share;
  };
  return test_support::BuildView(scene);
}

class OcclusionSceneOfTest : public testing::TestWithParam<ScenePrimitives> {};
INSTANTIATE_TEST_SUITE_P(FacesAndBricks, OcclusionSceneOfTest,
                         testing::Values(ScenePrimitives::kFaces, ScenePrimitives::kBricks));

TEST_P(OcclusionSceneOfTest, AgreesWithWalkingTheVoxels) {
  std::mt19937_64 random(7);
  parallel::Serial serial;
  for (const double share : {0.02, 0.1, 0.4}) {
    const model::PlanningView model = Rubble(random(), share);
    const OpaqueGrid grid(model);
    const OcclusionScene scene =
        OcclusionScene::Create(grid, serial, {}, {.primitives = GetParam()}).value();
    ASSERT_GT(scene.primitives(), 100u);
    std::vector<model::VoxelIndex> empty;
    for (int z = model.bounds().min.z(); z < model.bounds().max.z(); ++z) {
      for (int y = model.bounds().min.y(); y < model.bounds().max.y(); ++y) {
        for (int x = model.bounds().min.x(); x < model.bounds().max.x(); ++x) {
          if (model.Empty({x, y, z})) empty.push_back({x, y, z});
        }
      }
    }
    const auto somewhere = [&] {
      Eigen::Vector3d p = empty[random() % empty.size()].cast<double>();
      for (int a = 0; a < 3; ++a)
        p[a] += 0.02 + 0.96 * static_cast<double>(random() >> 11) * 0x1p-53;
      return p;
    };
    int blocked = 0;
    int wrong = 0;
    constexpr int kPackets = 5000;
    for (int packet = 0; packet < kPackets; ++packet) {
      // What is traced is what floats hold: the oracle walks the same segment.
      const Eigen::Vector3f origin = scene.ToScene(somewhere());
      TargetPacket targets;
      const auto valid = static_cast<uint32_t>(random() & 0xff);
      uint32_t expected = 0;
      for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3f to = scene.ToScene(somewhere());
        targets.x[i] = to.x();
        targets.y[i] = to.y();
        targets.z[i] = to.z();
        const bool clear = WalkVoxels(
            origin.cast<double>(), to.cast<double>(),
            [&](const model::VoxelIndex& v, double) { return grid.Empty(v + grid.box().min); });
        if (!clear) expected |= 1u << i;
      }
      expected &= valid;
      const uint32_t found = scene.Occluded(origin, targets, valid);
      wrong += std::popcount(found ^ expected);
      blocked += std::popcount(found);
    }
    EXPECT_GT(blocked, kPackets / 10);
    EXPECT_LT(blocked, kPackets * 4);
    // Of 20,000 segments, those that pass an edge within the rounding of a float.
    EXPECT_LE(wrong, 2) << "share " << share;
  }
}

TEST(TargetTest, LiesInEmptySpaceAndInFront) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  const OpaqueGrid grid(model);
  size_t cells = 0;
  size_t direct = 0;
  model.ForEachSurface([&](const model::VoxelIndex& v, model::VoxelState,
                           const model::SurfaceVoxel& surface) {
    ++cells;
    const auto target = TargetOf(grid, v, surface.normal);
    ASSERT_TRUE(target.has_value());  // every surface voxel of this scene has an empty neighbour
    EXPECT_TRUE(model.Empty(target->array().floor().cast<int>()));
    const Eigen::Vector3d offset = *target - (v.cast<double>().array() + 0.5).matrix();
    EXPECT_LE(offset.norm(), 2.4501);
    direct += std::abs(offset.norm() - 1.45) < 1e-5;
  });
  EXPECT_GT(direct, cells * 9 / 10);
}

TEST(TargetTest, BuriedCellHasNone) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  EXPECT_FALSE(TargetOf(OpaqueGrid(model), {-500, 0, 0}, Eigen::Vector3f::UnitX()).has_value());
}

// Whether a ray runs along an edge: beside it, to one side or another, something else is met.
bool Grazes(const OpaqueGrid& grid, const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  int visible = 0;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d aside =
        2e-4 * Eigen::Vector3d(k & 1 ? 1.1 : -0.9, k & 2 ? 1.2 : -0.8, k & 4 ? 1.3 : -0.7);
    visible += WalkVoxels(
        from.cast<double>() + aside, to.cast<double>() + aside,
        [&](const model::VoxelIndex& v, double) { return grid.Empty(v + grid.box().min); });
  }
  return visible > 0 && visible < 8;
}

// Rays as the planner casts them: from the middles of viewcells, which are corners of voxels, to
// targets in front of surface. Only those that run along an edge may be decided differently.
void ExpectDifferOnlyAlongEdges(const model::PlanningView& model, const OpaqueGrid& grid,
                                const OcclusionScene& one, const OcclusionScene& other) {
  std::mt19937_64 random(11);
  std::vector<Eigen::Vector3f> targets;
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState, const model::SurfaceVoxel& surface) {
        const auto target = TargetOf(grid, v, surface.normal);
        if (target.has_value()) targets.push_back(one.ToScene(*target));
      });
  ASSERT_GT(targets.size(), 1000u);
  const Eigen::Vector3i cells = (grid.box().max - grid.box().min) / 2;
  int views = 0;
  int rays = 0;
  int occluded = 0;
  int different = 0;
  for (int tried = 0; tried < 100000 && views < test_support::Runs(200); ++tried) {
    Eigen::Vector3i cell;  // of 2 voxels
    for (int a = 0; a < 3; ++a) {
      cell[a] = static_cast<int>(random() % static_cast<uint64_t>(cells[a]));
    }
    if (!grid.Empty(model::VoxelIndex(2 * cell + grid.box().min))) continue;
    ++views;
    const Eigen::Vector3f origin = (2 * cell).cast<float>().array() + 1.0f;
    for (size_t at = random() % 64; at + 8 <= targets.size(); at += 64) {
      TargetPacket packet;
      for (size_t k = 0; k < 8; ++k) {
        packet.x[k] = targets[at + k].x();
        packet.y[k] = targets[at + k].y();
        packet.z[k] = targets[at + k].z();
      }
      const uint32_t hits = one.Occluded(origin, packet, 0xff);
      rays += 8;
      occluded += std::popcount(hits);
      for (uint32_t bits = hits ^ other.Occluded(origin, packet, 0xff); bits != 0;
           bits &= bits - 1) {
        ++different;
        const Eigen::Vector3f& target = targets[at + static_cast<size_t>(std::countr_zero(bits))];
        EXPECT_TRUE(Grazes(grid, origin, target))
            << "from " << origin.transpose() << " to " << target.transpose();
      }
    }
  }
  EXPECT_EQ(views, test_support::Runs(200));
  EXPECT_GT(occluded, rays / 20);
  EXPECT_LT(different, rays / 1000);
  std::cout << different << " of " << rays << " rays differ\n";
}

TEST(OcclusionSceneTest, NarrowAndWideInstructionsDifferOnlyAlongEdges) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this processor has no AVX2";
  parallel::Serial serial;
  for (const model::PlanningView& model :
       {test_support::BuildView(test_support::FurnishedRoom(3)), Rubble(5, 0.1)}) {
    const OpaqueGrid grid(model);
    ExpectDifferOnlyAlongEdges(
        model, grid,
        OcclusionScene::Create(grid, serial, {}, {RayInstructions::kSse42, {}}).value(),
        OcclusionScene::Create(grid, serial, {}, {RayInstructions::kAvx2, {}}).value());
  }
}

// The same room, and a brick that was seen empty 1,600 voxels before it: floats hold what is in the
// room to a ten-thousandth of a voxel.
model::PlanningView FarFromTheCorner(const model::PlanningView& room) {
  std::vector<model::BrickAt> bricks(room.bricks().begin(), room.bricks().end());
  const auto empty = std::find_if(bricks.begin(), bricks.end(), [](const model::BrickAt& at) {
    return at.contents->surface.empty();
  });
  bricks.push_back({empty->brick - model::VoxelIndex(200, 200, 0), empty->contents});
  return {room.voxel_size(), 1, bricks, room.stations()};
}

TEST(OcclusionSceneTest, FacesAndBricksDifferOnlyAlongEdges) {
  parallel::Serial serial;
  const model::PlanningView room = test_support::BuildView(test_support::FurnishedRoom(3));
  for (const model::PlanningView& model : {room, Rubble(5, 0.1)}) {
    const OpaqueGrid grid(model);
    ExpectDifferOnlyAlongEdges(
        model, grid,
        OcclusionScene::Create(grid, serial, {}, {{}, ScenePrimitives::kFaces}).value(),
        OcclusionScene::Create(grid, serial, {}, {{}, ScenePrimitives::kBricks}).value());
  }
}

// Where a large site is told by floats of which less is left behind the point.
TEST(OcclusionSceneTest, BricksAreToldFarFromTheCorner) {
  parallel::Serial serial;
  const model::PlanningView room = test_support::BuildView(test_support::FurnishedRoom(3));
  const model::PlanningView far = FarFromTheCorner(room);
  const OpaqueGrid near_grid(room);
  const OpaqueGrid far_grid(far);
  const auto by_bricks = [&](const OpaqueGrid& grid) {
    return OcclusionScene::Create(grid, serial, {}, {{}, ScenePrimitives::kBricks}).value();
  };
  const OcclusionScene near_scene = by_bricks(near_grid);
  const OcclusionScene far_scene = by_bricks(far_grid);
  const Eigen::Vector3f offset = (near_scene.corner() - far_scene.corner()).cast<float>();
  ASSERT_GT(offset.x(), 1500);
  std::mt19937_64 random(5);
  int rays = 0;
  int occluded = 0;
  int different = 0;
  for (int packet = 0; packet < test_support::Runs(20000); ++packet) {
    const auto somewhere = [&]() -> Eigen::Vector3f {
      while (true) {
        Eigen::Vector3i at;  // in steps of an eighth of a voxel, which both hold exactly
        for (int a = 0; a < 3; ++a) {
          at[a] = static_cast<int>(
              random() % static_cast<uint64_t>(8 * (near_grid.box().max - near_grid.box().min)[a]));
        }
        if (!near_grid.OpaqueAt(at / 8)) return at.cast<float>() / 8;
      }
    };
    const Eigen::Vector3f origin = somewhere();
    TargetPacket near_targets;
    TargetPacket far_targets;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3f to = somewhere();
      near_targets.x[i] = to.x();
      near_targets.y[i] = to.y();
      near_targets.z[i] = to.z();
      far_targets.x[i] = to.x() + offset.x();
      far_targets.y[i] = to.y() + offset.y();
      far_targets.z[i] = to.z() + offset.z();
    }
    const uint32_t hits = near_scene.Occluded(origin, near_targets, 0xff);
    rays += 8;
    occluded += std::popcount(hits);
    different += std::popcount(hits ^ far_scene.Occluded(origin + offset, far_targets, 0xff));
  }
  EXPECT_GT(occluded, rays / 20);
  EXPECT_LT(occluded, rays * 19 / 20);
  EXPECT_LE(different, rays / 10000);
}

TEST(OcclusionSceneTest, OnlyLargeSitesAreTracedByBricks) {
  const model::PlanningView room = test_support::BuildView(test_support::FurnishedRoom(3));
  size_t mixed = 0;
  for (const model::BrickAt& at : room.bricks()) {
    const auto is_empty = [](model::VoxelState state) {
      return state == model::VoxelState::kEmpty;
    };
    const auto& state = at.contents->state;
    mixed += std::any_of(state.begin(), state.end(), is_empty) &&
             !std::all_of(state.begin(), state.end(), is_empty);
  }
  EXPECT_GT(mixed, 100u);
  EXPECT_EQ(MixedBricks(room), mixed);
  EXPECT_EQ(OcclusionScene::PrimitivesOf(room), ScenePrimitives::kFaces);
  // Two hundred rooms beside one another.
  std::vector<model::BrickAt> bricks;
  for (int i = 0; i < 200; ++i) {
    for (const model::BrickAt& at : room.bricks()) {
      bricks.push_back({at.brick + model::VoxelIndex(40 * i, 0, 0), at.contents});
    }
  }
  const model::PlanningView rooms(room.voxel_size(), 1, bricks, {});
  EXPECT_EQ(MixedBricks(rooms), 200 * mixed);
  EXPECT_EQ(OcclusionScene::PrimitivesOf(rooms),
            200 * mixed > 131072 ? ScenePrimitives::kBricks : ScenePrimitives::kFaces);
}

}  // namespace
}  // namespace vantage::visibility
