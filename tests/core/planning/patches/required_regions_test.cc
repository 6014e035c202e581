// Surface is graded, planned for and counted by the region that it lies in: against a loop over all
// voxels that tells regions by formulas of its own.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "core/planning/openings/measure_coverage.h"
#include "core/planning/patches/patches.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

constexpr double kEverywhere = 1500;  // D

RequiredRegion BoxRegion(const char* name, double x0, double y0, double x1, double y1) {
  RequiredRegion region;
  region.name = name;
  region.outline = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  return region;
}

// A room of 6 x 5 x 2.7 m, of which some surface has every density up to 6,000.
class RequiredRegionsTest : public testing::Test {
 protected:
  RequiredRegionsTest() {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(3);
    scene.density = [](const Eigen::Vector3d& p) {
      return 6000 / (1 + (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm());
    };
    model_ = std::make_shared<model::PlanningView>(test_support::BuildView(scene));
    config_.required_density = kEverywhere;
    config_.unknown_depth = 0;
    config_.viewcell_size = 0.4;
    config_.regions = {BoxRegion("coarse", 3, -1, 7, 6), BoxRegion("fine and low", -1, -1, 3, 2),
                       BoxRegion("of no interest", -1, 2, 3, 3.5)};
    config_.regions[0].outline.insert(config_.regions[0].outline.begin() + 1, {4.5, 1.25});
    config_.regions[0].density = 300;
    config_.regions[1].density = 5000;
    config_.regions[1].weight = 3;
    config_.regions[1].max_z = 1;
    config_.regions[2].weight = 0;
  }

  // The region of a place, by formulas for this one site; -1: none.
  static int RegionOf(const Eigen::Vector3d& p) {
    if (p.x() >= 3) {
      // A triangle is cut out of the coarse one, whose tip is at (4.5, 1.25).
      const double along = p.x() < 4.5 ? (p.x() - 3) / 1.5 : (7 - p.x()) / 2.5;
      return p.y() > -1 + 2.25 * along ? 0 : -1;
    }
    if (p.y() < 2) return p.z() < 1 ? 1 : -1;
    return p.y() < 3.5 ? 2 : -1;
  }
  static double DensityIn(int region) {
    return region == 0 ? 300 : region == 1 ? 5000 : kEverywhere;
  }

  std::shared_ptr<const model::PlanningView> model_;
  PlanningConfig config_;
};

struct Figures {
  std::array<double, model::kSurfaceKinds> area{};
  double at_density = 0;
};
void ExpectSame(const CoverageFigures& measured, const Figures& expected) {
  double all = 0;
  for (size_t kind = 0; kind < expected.area.size(); ++kind) {
    EXPECT_NEAR(measured.area[kind], expected.area[kind], 1e-6) << kind;
    all += expected.area[kind];
  }
  EXPECT_NEAR(measured.area_at_density, expected.at_density, 1e-6);
  ASSERT_EQ(measured.estimated_coverage.has_value(), all > 0);
  if (all > 0) {
    EXPECT_NEAR(*measured.estimated_coverage, expected.at_density / all, 1e-9);
  }
}

TEST_F(RequiredRegionsTest, CoverageIsThatOfEachSurfaceInItsRegion) {
  Figures whole;
  std::array<Figures, 3> by_region;
  model_->ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const int region = RegionOf(model_->Centre(v));
        if (region == 2) return;
        const bool done = state == model::VoxelState::kTrueSurface &&
                          static_cast<double>(surface.density) >= DensityIn(region);
        for (Figures* figures :
             {&whole, region < 0 ? nullptr : &by_region[static_cast<size_t>(region)]}) {
          if (figures == nullptr) continue;
          figures->area[static_cast<size_t>(model::KindOf(state))] += surface.area;
          if (done) figures->at_density += surface.area;
        }
      });
  const Coverage coverage = MeasureCoverage(*model_, {}, config_).value();
  ExpectSame(coverage, whole);
  ASSERT_EQ(coverage.regions.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    SCOPED_TRACE(config_.regions[i].name);
    EXPECT_EQ(coverage.regions[i].name, config_.regions[i].name);
    EXPECT_EQ(coverage.regions[i].required_density, DensityIn(static_cast<int>(i)));
    ExpectSame(coverage.regions[i], by_region[i]);
  }
  // Each asks for something else, or nothing was tested.
  EXPECT_GT(*coverage.regions[0].estimated_coverage, *coverage.estimated_coverage + 0.1);
  EXPECT_LT(*coverage.regions[1].estimated_coverage, *coverage.estimated_coverage - 0.1);
  EXPECT_FALSE(coverage.regions[2].estimated_coverage.has_value());
}

TEST_F(RequiredRegionsTest, WhatIsDeficientLacksWhatItsRegionRequires) {
  std::map<std::tuple<int, int, int>, int> deficient;  // to its region
  model_->ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const int region = RegionOf(model_->Centre(v));
        const bool done = state == model::VoxelState::kTrueSurface &&
                          static_cast<double>(surface.density) >= DensityIn(region);
        if (region != 2 && !done) deficient[{v.x(), v.y(), v.z()}] = region;
      });
  const PatchSet set = RankPatches(config_, ExtractPatches(*model_, config_).value()).value();
  ASSERT_EQ(set.cells.size(), deficient.size());
  for (const DeficientCell& cell : set.cells) {
    const auto it = deficient.find({cell.voxel.x(), cell.voxel.y(), cell.voxel.z()});
    ASSERT_NE(it, deficient.end());
    EXPECT_FLOAT_EQ(cell.enough, static_cast<float>(DensityIn(it->second)));
    EXPECT_FLOAT_EQ(cell.worth, static_cast<float>((it->second == 1 ? 3 : 1) * kEverywhere /
                                                   DensityIn(it->second)));
  }
  for (const Patch& patch : set.patches) {
    double importance = 0;
    for (const uint32_t i : patch.cells) {
      const DeficientCell& cell = set.cells[i];
      importance += static_cast<double>(cell.worth * cell.area * (cell.enough - cell.density));
    }
    EXPECT_NEAR(patch.importance, importance, 1e-5 * importance);
  }
}

// With a region all around, whatever it asks for, as with that asked for everywhere; but that a
// score stays what it is worth in area.
TEST_F(RequiredRegionsTest, ARegionOfEverythingIsTheSameAsNone) {
  for (const bool by_density : {true, false}) {
    SCOPED_TRACE(by_density);
    config_.density_on_false_surface = by_density;
    config_.regions.clear();
    config_.required_density = 600;
    const test_support::PlanningProblem everywhere(model_, config_);
    config_.required_density = kEverywhere;
    config_.regions = {BoxRegion("all", -100, -100, 100, 100)};
    config_.regions[0].density = 600;
    config_.regions[0].weight = 2;
    const test_support::PlanningProblem region(model_, config_);
    ASSERT_EQ(region.views.size(), everywhere.views.size());
    parallel::Serial serial;
    const auto expected = everywhere.BruteForce(serial);
    const auto scores = region.BruteForce(serial);
    double most = 0;
    for (size_t v = 0; v < scores.size(); ++v) {
      const double gain = expected[v].score / 600;  // m2
      EXPECT_NEAR(scores[v].score / kEverywhere, 2 * gain, 1e-4 * gain + 1e-9);
      most = std::max(most, gain);
    }
    EXPECT_GT(most, 1);
    EXPECT_EQ(region.patches.cells.size(), everywhere.patches.cells.size());
  }
}

// What is prepared for one set of regions is not shared with another.
TEST_F(RequiredRegionsTest, AnotherRequirementIsAnotherProblem) {
  parallel::Serial serial;
  const sensor::ScannerModel scanner;
  const auto before = PlanningProblem::Prepare({*model_, scanner, config_}, serial).value();
  PlanningConfig other = config_;
  other.regions[1].weight = 1;
  const auto after =
      PlanningProblem::Prepare({*model_, scanner, other, before.get()}, serial).value();
  const auto fresh = PlanningProblem::Prepare({*model_, scanner, other}, serial).value();
  const auto importance = [](const PlanningProblem& problem) {
    double sum = 0;
    for (const Patch& patch : problem.patches().patches) sum += patch.importance;
    return sum;
  };
  EXPECT_EQ(importance(*after), importance(*fresh));
  EXPECT_LT(importance(*after), importance(*before));
}

}  // namespace
}  // namespace vantage::planning
