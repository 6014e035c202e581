#include "core/planning/patches/patches.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "core/planning/patches/collect_deficient.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Key = std::tuple<int, int, int>;
Key KeyOf(const model::VoxelIndex& v) { return {v.x(), v.y(), v.z()}; }

// The plane that grew a patch is not told, but there is one: what fits its cells best (the
// principal axes of their positions) strays at most twice as far. Returns the normal of that.
Eigen::Vector3d ExpectPlanar(const PatchSet& set, const Patch& patch,
                             const PatchTolerance& tolerance, double voxel) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const uint32_t i : patch.cells) mean += set.cells[i].position.cast<double>();
  mean /= static_cast<double>(patch.cells.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const uint32_t i : patch.cells) {
    const Eigen::Vector3d d = set.cells[i].position.cast<double>() - mean;
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  Eigen::Vector3d best = axes.eigenvectors().col(0);
  for (const uint32_t i : patch.cells) {
    const DeficientCell& cell = set.cells[i];
    EXPECT_LE(std::abs(best.dot(cell.position.cast<double>() - mean)),
              2 * tolerance.offset * voxel + 1e-6);
    EXPECT_GT(cell.normal.cast<double>().dot(patch.normal), std::cos(2 * tolerance.angle));
  }
  return best;
}

// What is missing of a furnished room, in ranked patches.
class PatchesTest : public ::testing::TestWithParam<int> {
 protected:
  PatchesTest()
      : model_(test_support::BuildView(
            test_support::FurnishedRoom(static_cast<uint64_t>(GetParam())))) {
    config_.unknown_depth = 0;  // what is lacking is D - q
    set_ = RankPatches(config_, ExtractPatches(model_, config_, tolerance_).value()).value();
  }
  void SetUp() override { ASSERT_GT(set_.patches.size(), 5u); }

  model::PlanningView model_;
  PlanningConfig config_;
  PatchTolerance tolerance_;
  PatchSet set_;
};

TEST_P(PatchesTest, EveryDeficientVoxelIsInExactlyOnePatchOfItsKind) {
  std::map<Key, model::SurfaceKind> deficient;
  double area = 0;
  model_.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state == model::VoxelState::kTrueSurface && surface.density >= 2500) return;
        deficient[KeyOf(v)] = model::KindOf(state);
        area += surface.area;
      });
  ASSERT_EQ(set_.cells.size(), deficient.size());
  EXPECT_NEAR(set_.area, area, 1e-6 * area);
  uint32_t next = 0;
  for (const Patch& patch : set_.patches) {
    for (const uint32_t i : patch.cells) {
      ASSERT_EQ(i, next++);  // side by side, each once
      const auto it = deficient.find(KeyOf(set_.cells[i].voxel));
      ASSERT_NE(it, deficient.end());
      EXPECT_EQ(it->second, patch.kind);
      deficient.erase(it);
    }
  }
  EXPECT_TRUE(deficient.empty());
}

TEST_P(PatchesTest, EveryPatchIsPlanarWithinTheTolerance) {
  int large = 0;
  for (const Patch& patch : set_.patches) {
    const Eigen::Vector3d best = ExpectPlanar(set_, patch, tolerance_, model_.voxel_size());
    // Where a patch is wide enough for its cells to tell its plane, that is the one it names; its
    // normal is the mean of theirs, which a slanted staircase of voxels turns by 3 degrees.
    if (patch.length_v < 0.5) continue;
    ++large;
    EXPECT_GT(std::abs(best.dot(patch.normal)), std::cos(0.05));
    for (const uint32_t i : patch.cells) {
      EXPECT_LT(std::abs(patch.normal.dot(set_.cells[i].position.cast<double>() - patch.centre)),
                2 * tolerance_.offset * model_.voxel_size());
    }
  }
  EXPECT_GT(large, 3);
}

// The same surface, facing up wherever it nearly does: as a scan has it, whose normals are smooth.
model::PlanningView WithSmoothFloor(const model::PlanningView& model) {
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : model.bricks()) {
    auto brick = std::make_shared<model::Brick>(*at.contents);
    brick->surface.clear();
    for (model::SurfaceVoxel surface : at.contents->surface) {
      if (surface.normal.z() > 0.7F) surface.normal = Eigen::Vector3f::UnitZ();
      brick->surface.push_back(surface);
    }
    bricks.push_back({at.brick, std::move(brick)});
  }
  return {model.voxel_size(), model.version(), std::move(bricks), model.stations()};
}

// A floor that rises to the middle of the room and falls again, by steps of a voxel: all of it
// faces up and hangs together.
TEST(PatchesOfAHillTest, IsNotOnePatch) {
  test_support::ClosedFormScene scene;
  scene.extent =
      Eigen::AlignedBox3d(Eigen::Vector3d(-0.1, -0.1, -0.1), Eigen::Vector3d(6.1, 2.1, 2));
  scene.solid = [](const Eigen::Vector3d& p) {
    const double steps = std::floor(2 * std::min(p.x(), 6 - p.x()));  // each half a metre long
    return p.x() < 0 || p.x() > 6 || p.y() < 0 || p.y() > 2 || p.z() < 0.05 * steps;
  };
  const model::PlanningView model = WithSmoothFloor(test_support::BuildView(scene));
  const PatchTolerance tolerance;
  const PatchSet set = ExtractPatches(model, {}, tolerance).value();
  int level = 0;
  for (const Patch& patch : set.patches) {
    ExpectPlanar(set, patch, tolerance, model.voxel_size());
    level += patch.normal.z() > 0.9 && patch.area > 0.5 ? 1 : 0;
  }
  EXPECT_GE(level, 5);
}

TEST_P(PatchesTest, TheRectangleHoldsItsCellsAndNoMore) {
  const double half = model_.voxel_size() / 2;
  for (const Patch& patch : set_.patches) {
    EXPECT_NEAR(patch.normal.norm(), 1, 1e-9);
    EXPECT_NEAR(patch.axis_u.norm(), 1, 1e-9);
    EXPECT_NEAR(patch.normal.dot(patch.axis_u), 0, 1e-9);
    EXPECT_GE(patch.length_u, patch.length_v);
    Eigen::AlignedBox2d cells;
    for (const uint32_t i : patch.cells) {
      const Eigen::Vector3d d = set_.cells[i].position.cast<double>() - patch.centre;
      cells.extend(Eigen::Vector2d(d.dot(patch.axis_u), d.dot(patch.normal.cross(patch.axis_u))));
    }
    EXPECT_NEAR(cells.max().x() + half, patch.length_u / 2, 1e-9);
    EXPECT_NEAR(cells.min().x() - half, -patch.length_u / 2, 1e-9);
    EXPECT_NEAR(cells.max().y() + half, patch.length_v / 2, 1e-9);
    EXPECT_NEAR(cells.min().y() - half, -patch.length_v / 2, 1e-9);
  }
}

TEST_P(PatchesTest, AreaAndDeficitAreTheSumsOverItsCells) {
  for (const Patch& patch : set_.patches) {
    double area = 0;
    double deficit = 0;
    for (const uint32_t i : patch.cells) {
      const model::SurfaceVoxel surface = model_.Surface(set_.cells[i].voxel).value();
      const double density =
          patch.kind == model::SurfaceKind::kTrue ? static_cast<double>(surface.density) : 0;
      area += static_cast<double>(surface.area);
      deficit += (2500 - density) * static_cast<double>(surface.area);
    }
    EXPECT_NEAR(patch.area, area, 1e-6 * area);
    EXPECT_NEAR(patch.deficit, deficit, 1e-5 * deficit);
  }
}

TEST_P(PatchesTest, TheMostImportantComesFirst) {
  config_.weights = {1, 7, 1, 1};  // occlusions before what is larger
  set_ = RankPatches(config_, set_).value();
  double before = set_.patches.front().importance;
  for (const Patch& patch : set_.patches) {
    const double weight = patch.kind == model::SurfaceKind::kOcclusion ? 7 : 1;
    EXPECT_NEAR(patch.importance, weight * patch.deficit, 1e-9 * patch.importance);
    EXPECT_LE(patch.importance, before);
    before = patch.importance;
  }
  EXPECT_EQ(set_.patches.front().kind, model::SurfaceKind::kOcclusion);
}
INSTANTIATE_TEST_SUITE_P(Seeds, PatchesTest, ::testing::Range(1, 5));

TEST(PatchesOfABoxTest, AWallIsOnePatchWithItsMeasures) {
  test_support::ClosedFormScene scene;
  const Eigen::AlignedBox3d room(Eigen::Vector3d::Zero(), Eigen::Vector3d(3, 2, 1.5));
  scene.extent = Eigen::AlignedBox3d(room.min().array() - 0.1, room.max().array() + 0.1);
  scene.solid = [=](const Eigen::Vector3d& p) { return !room.contains(p); };
  scene.density = [](const Eigen::Vector3d& p) { return p.x() < 0 ? 500 : 5000; };
  const model::PlanningView model = test_support::BuildView(scene);
  PlanningConfig config;
  const PatchSet set = RankPatches(config, ExtractPatches(model, config).value()).value();
  // The wall at x = 0; its rim has tilted normals and may be patches of its own.
  const Patch& wall = set.patches.front();
  EXPECT_NEAR(wall.normal.x(), 1, 1e-6);
  EXPECT_NEAR(wall.length_u, 2, 0.1001);
  EXPECT_NEAR(wall.length_v, 1.5, 0.1001);
  EXPECT_NEAR(wall.area, wall.length_u * wall.length_v, 1e-3);
  EXPECT_NEAR(wall.mean_density, 500, 1e-3);
  EXPECT_NEAR(wall.deficit, 2000 * wall.area, 1e-2);
  EXPECT_NEAR(wall.centre.y(), 1, 0.01);
}

// A view in which the surface in `region` was missed so many times, and given up or not.
model::PlanningView WithMissed(const model::PlanningView& model, const Region& region,
                               uint8_t missed, bool given_up) {
  std::vector<model::BrickAt> bricks;
  for (const model::BrickAt& at : model.bricks()) {
    auto brick = std::make_shared<model::Brick>(*at.contents);
    brick->surface.clear();
    for (model::SurfaceVoxel surface : at.contents->surface) {
      if (region.contains(surface.centroid.cast<double>())) {
        surface.missed = missed;
        surface.given_up = given_up;
      }
      brick->surface.push_back(surface);
    }
    bricks.push_back({at.brick, std::move(brick)});
  }
  return {model.voxel_size(), model.version(), std::move(bricks), model.stations()};
}

// Deficient voxels by where they are.
std::map<Key, DeficientCell> ByVoxel(const PatchSet& set) {
  std::map<Key, DeficientCell> cells;
  for (const DeficientCell& cell : set.cells) cells[KeyOf(cell.voxel)] = cell;
  return cells;
}

class PatchesOfPartTest : public ::testing::Test {
 protected:
  PatchSet Extract(const model::PlanningView& model) const {
    return ExtractPatches(model, config_).value();
  }
  const model::PlanningView model_ = test_support::BuildView(test_support::FurnishedRoom(1));
  const Region part_{Eigen::Vector3d(1, 1, -1), Eigen::Vector3d(3, 3, 3)};
  PlanningConfig config_;
};

TEST_F(PatchesOfPartTest, SurfaceOutsideTheRegionDoesNotCount) {
  const PatchSet all = Extract(model_);
  config_.region_of_interest = part_;
  const PatchSet inside = Extract(model_);
  size_t expected = 0;
  for (const DeficientCell& cell : all.cells) {
    expected += part_.contains(model_.Centre(cell.voxel)) ? 1 : 0;
  }
  EXPECT_EQ(inside.cells.size(), expected);
  EXPECT_GT(expected, 100u);
  EXPECT_LT(expected, all.cells.size());
  for (const DeficientCell& cell : inside.cells) {
    EXPECT_TRUE(part_.contains(model_.Centre(cell.voxel)));
  }
}

TEST_F(PatchesOfPartTest, SurfaceThatIsGivenUpDoesNotCount) {
  const PatchSet all = Extract(model_);
  const PatchSet rest = Extract(WithMissed(model_, part_, 2, true));
  const auto cells = ByVoxel(rest);
  size_t given_up = 0;
  for (const DeficientCell& cell : all.cells) {
    const bool gone = part_.contains(cell.position.cast<double>());
    given_up += gone ? 1 : 0;
    EXPECT_EQ(cells.count(KeyOf(cell.voxel)), gone ? 0u : 1u);
  }
  EXPECT_EQ(rest.cells.size(), all.cells.size() - given_up);
  EXPECT_GT(given_up, 100u);
}

// What was missed once may fail again, and counts all the same.
TEST_F(PatchesOfPartTest, SurfaceThatWasMissedIsLessLikelyToBeMeasured) {
  const PatchSet set = Extract(WithMissed(model_, part_, 1, false));
  EXPECT_EQ(set.cells.size(), Extract(model_).cells.size());
  for (const DeficientCell& cell : set.cells) {
    const bool missed = part_.contains(cell.position.cast<double>());
    EXPECT_NEAR(static_cast<double>(cell.success), missed ? 2.0 / 3 : 1, 1e-6);
  }
}

TEST(SuccessProbabilityTest, FallsWithFailures) {
  EXPECT_EQ(SuccessProbability(0), 1);
  EXPECT_NEAR(SuccessProbability(1), 2.0 / 3, 1e-12);
  EXPECT_NEAR(SuccessProbability(2), 0.5, 1e-12);
}

}  // namespace
}  // namespace vantage::planning
