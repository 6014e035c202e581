// Surface that a scan should have measured and did not does not count again from the same place
// (algorithm.md section 4, 'What never comes').
#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/plan/planning_config.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::planning {
namespace {

class PromisesTest : public testing::TestWithParam<model::ClosedFormScene> {
 protected:
  // m^2 at the required density that the planner promises from a place.
  double PromisedAt(const model::PartialModel& model, const Eigen::Vector3d& position) {
    const absl::StatusOr<ViewEvaluation> view =
        EvaluateView(*model.Publish(), scanner_, config_, position, serial_);
    EXPECT_TRUE(view.ok()) << view.status();
    return view.ok() ? view->view.score / config_.required_density : 0;
  }
  void Scan(model::PartialModel& model, const std::string& id, const Eigen::Vector3d& position) {
    const Eigen::Isometry3d pose = model::PoseAt(position);
    model::ScanOptions options;
    options.noise = 0.003;
    options.step = step_;
    options.seed = ++seed_;
    const auto scan = model::ScanScene(GetParam(), pose, options);
    scanner_ = scan.scanner;
    ASSERT_TRUE(model.Insert(id, scan, pose, serial_).ok());
  }

  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
  double step_ = sensor::Radians(0.4);
  uint64_t seed_ = 0;
};

TEST_P(PromisesTest, TwoScansFromAPlaceLeaveNothingPromisedThere) {
  config_.required_density = 1000;
  step_ = sensor::Radians(0.2);  // two samples fall on every voxel at least, however askew
  const Eigen::Vector3d place = GetParam().stations[0];
  auto model = model::PartialModel::Create({}).value();
  Scan(*model, "first", place);
  const double once = PromisedAt(*model, place);
  Scan(*model, "second", place);
  const double twice = PromisedAt(*model, place);
  std::printf("%s: %.3f m^2 promised after one scan, %.3f after two\n", GetParam().name.c_str(),
              once, twice);
  // In bare rooms one scan leaves next to nothing that another from there could bring.
  const std::set<std::string> bare = {"empty room", "window", "pillar", "thin wall"};
  if (bare.count(GetParam().name) == 0) {
    EXPECT_GT(once, 0.05);
  }
  EXPECT_LE(twice, 0.02);
}

// Only surface that no scan can measure is given up. The room next door stays worth a visit however
// often its door was seen.
TEST_P(PromisesTest, WhatHidesRoomIsNotGivenUp) {
  auto model = model::PartialModel::Create({}).value();
  const Eigen::Vector3d place = GetParam().stations[0];
  Scan(*model, "first", place);
  Scan(*model, "second", place + Eigen::Vector3d(0.3, 0.2, 0.1));
  Scan(*model, "third", place + Eigen::Vector3d(0.1, -0.3, -0.1));
  const auto view = model->Publish();
  double open = 0;  // m^2 of false surface away from anything solid
  double given_up = 0;
  view->ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (!model::IsFalseSurface(state) || state == model::VoxelState::kFalseHole) return;
        if (GetParam().DistanceToSurface(view->Centre(v), 1) < 2 * view->voxel_size()) return;
        open += static_cast<double>(surface.area);
        if (surface.given_up) given_up += static_cast<double>(surface.area);
      });
  std::printf("%s: %.3f m^2 of %.2f m^2 given up\n", GetParam().name.c_str(), given_up, open);
  EXPECT_GT(open, 0.4);
  EXPECT_LE(given_up, 0.01 * open);
}

std::vector<model::ClosedFormScene> Scenes() {
  std::vector<model::ClosedFormScene> scenes = model::AllScenes();
  for (uint64_t seed = 1; seed <= 3; ++seed) scenes.push_back(model::RandomScene(seed));
  return scenes;
}
INSTANTIATE_TEST_SUITE_P(Scenes, PromisesTest, testing::ValuesIn(Scenes()));

}  // namespace
}  // namespace vantage::planning
