// Gains of views where rays went through glass and did not come back: surface whose rays dropped
// out counts no longer from there, and still counts from elsewhere (algorithm.md section 4, 'What
// never comes').
#include "core/planning/evaluate_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/plan/planning_config.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

// Two rooms of 4 x 4 x 2.6 m, side by side along x, with an opening of 2.4 x 2 m in the wall
// between them at x = 4 that a pane of glass may slide over.
simulation::TriangleMesh TwoRoomsWithPane(bool closed) {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  builder.Box({-0.2, -0.2, -0.2}, {9.9, 4.2, 0});
  builder.Box({-0.2, -0.2, 2.6}, {9.9, 4.2, 2.8});
  builder.Box({-0.2, -0.2, 0}, {0, 4.2, 2.6});
  builder.Box({9.7, -0.2, 0}, {9.9, 4.2, 2.6});
  builder.Box({0, -0.2, 0}, {9.7, 0, 2.6});
  builder.Box({0, 4, 0}, {9.7, 4.2, 2.6});
  builder.Box({4, 0, 0}, {4.1, 0.8, 2.6});
  builder.Box({4, 3.2, 0}, {4.1, 4, 2.6});
  builder.Box({4, 0.8, 2}, {4.1, 3.2, 2.6});
  builder.Box({7.2, 3.1, 0}, {8.4, 4, 1.1});
  builder.Box({9.2, 0, 0}, {9.7, 1.6, 1.8});
  builder.Box({0, 0, 0}, {0.6, 0.9, 2});
  if (closed) {
    builder.Quad({Eigen::Vector3d(4.05, 0.8, 0), Eigen::Vector3d(4.05, 3.2, 0),
                  Eigen::Vector3d(4.05, 3.2, 2), Eigen::Vector3d(4.05, 0.8, 2)},
                 simulation::Material::kGlass);
  }
  return mesh;
}

const Eigen::Vector3d kNear(1.6, 2, 1.5);   // in the first room
const Eigen::Vector3d kFar(6.2, 2.1, 1.4);  // in the second

class EvaluateViewTest : public testing::Test {
 protected:
  EvaluateViewTest() {
    coarse_.azimuth_step = coarse_.elevation_step = sensor::Radians(1);
    fine_.azimuth_step = fine_.elevation_step = sensor::Radians(0.3);
    config_.required_density = 1000;
  }
  struct Shot {
    std::string id;
    Eigen::Vector3d position;
    bool closed;  // the pane
    bool coarse;
  };
  // Seen with the pane open, coarsely, from both rooms; then twice from the first with it closed.
  static std::vector<Shot> Shots() {
    return {{"c", kFar, false, true},
            {"b", kNear, false, true},
            {"a", kNear, true, false},
            {"d", kNear + Eigen::Vector3d(-0.1, 0.05, 0), true, false}};
  }
  void Insert(model::PartialModel& model, const Shot& shot) {
    const simulation::TriangleMesh mesh = TwoRoomsWithPane(shot.closed);
    sensor::Scan scan;
    scan.scanner = shot.coarse ? coarse_ : fine_;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = shot.position;
    scan.image = simulation::SimulatedScanner(mesh).Scan(scan.scanner, pose,
                                                         simulation::ScanFaults{}, 5, pool_);
    const auto report = model.Insert(shot.id, scan, pose, pool_);
    ASSERT_TRUE(report.ok()) << report.status();
  }
  // m^2 that a fine scan would bring, of the second room alone.
  double PromisedBehind(const model::PartialModel& model, const Eigen::Vector3d& position) {
    config_.min_counted_density_share = 0;  // most of it comes nearer to D, little comes to it
    config_.region_of_interest =
        Eigen::AlignedBox3d(Eigen::Vector3d(4.3, -0.5, -0.5), Eigen::Vector3d(10.5, 4.5, 3));
    const auto view = EvaluateView(*model.Publish(), fine_, config_, position, pool_);
    EXPECT_TRUE(view.ok()) << view.status();
    return view.ok() ? view->view.score / config_.required_density : 0;
  }
  size_t Dropouts(const model::PartialModel& model) {
    size_t dropouts = 0;
    for (const model::BrickAt& at : model.Publish()->bricks())
      dropouts += at.contents->dropouts.size();
    return dropouts;
  }

  sensor::ScannerModel coarse_, fine_;
  PlanningConfig config_;
  parallel::ThreadPool pool_{2};
};

TEST_F(EvaluateViewTest, NothingIsSaidOfPlacesThatNobodyHasSeen) {
  auto model = model::PartialModel::Create({}).value();
  Insert(*model, {"b", kNear, true, true});
  const auto behind = EvaluateView(*model->Publish(), coarse_, config_, {3, 2, 3.5}, pool_);
  ASSERT_TRUE(behind.ok()) << behind.status();
  EXPECT_FALSE(behind->feasible);
  EXPECT_EQ(behind->view.verdict.outcome, registration::RegistrationOutcome::kDoubtful);
  EXPECT_THAT(behind->view.verdict.reason, testing::HasSubstr("nothing can be said"));
  const auto seen = EvaluateView(*model->Publish(), coarse_, config_, {1.0, 2.6, 1.4}, pool_);
  ASSERT_TRUE(seen.ok()) << seen.status();
  EXPECT_TRUE(seen->view.verdict.registered()) << seen->view.verdict.reason;
}

TEST_F(EvaluateViewTest, NotPromisedAgainFromThereButFromElsewhere) {
  auto model = model::PartialModel::Create({}).value();
  const std::vector<Shot> shots = Shots();
  Insert(*model, shots[0]);
  Insert(*model, shots[1]);
  const double before = PromisedBehind(*model, kNear);
  const double inside = PromisedBehind(*model, kFar);
  EXPECT_EQ(Dropouts(*model), 0u);
  Insert(*model, shots[2]);
  const double after = PromisedBehind(*model, kNear);
  const double beside = PromisedBehind(*model, kNear + Eigen::Vector3d(-0.4, 0.2, 0.1));
  const double inside_after = PromisedBehind(*model, kFar);
  std::printf(
      "behind the pane: %.2f m^2 promised before, %.2f after, %.2f from beside; from "
      "behind it %.2f and %.2f\n",
      before, after, beside, inside, inside_after);
  EXPECT_GT(before, 3);
  // Within five degrees of head on the pane returns, and hides what is behind it as a thing would
  // that stood there: no dropout.
  EXPECT_LT(after, 0.1 * before);
  EXPECT_LT(beside, 0.1 * before);
  // No scan was made from the other side.
  EXPECT_GT(inside_after, 0.98 * inside);
}

TEST_F(EvaluateViewTest, TheSameInAnyOrderWithdrawnAndSaved) {
  std::vector<Shot> shots = Shots();
  auto model = model::PartialModel::Create({}).value();
  for (const Shot& shot : shots) Insert(*model, shot);
  EXPECT_GT(Dropouts(*model), 100u);
  auto other = model::PartialModel::Create({}).value();
  for (const size_t i : {2u, 0u, 3u, 1u}) Insert(*other, shots[i]);
  EXPECT_EQ(model->Digest(), other->Digest());
  EXPECT_EQ(Dropouts(*model), Dropouts(*other));

  const auto saved = model::PartialModel::Load(model->Save(pool_), SIZE_MAX, pool_);
  ASSERT_TRUE(saved.ok()) << saved.status();
  EXPECT_EQ((*saved)->Digest(), model->Digest());
  EXPECT_EQ(Dropouts(**saved), Dropouts(*model));

  for (model::PartialModel* each : {model.get(), saved->get()}) {
    ASSERT_TRUE(each->Withdraw("a", pool_).ok());
    ASSERT_TRUE(each->Withdraw("d", pool_).ok());
    EXPECT_EQ(Dropouts(*each), 0u);
  }
  auto never = model::PartialModel::Create({}).value();
  for (const size_t i : {0u, 1u}) Insert(*never, shots[i]);
  EXPECT_EQ(model->Digest(), never->Digest());
  EXPECT_EQ((*saved)->Digest(), never->Digest());
}

}  // namespace
}  // namespace vantage::planning
