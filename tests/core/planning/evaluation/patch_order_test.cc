// The paper's order against brute force.
#include "core/planning/evaluation/patch_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

class PatchOrderTest : public ::testing::Test {
 protected:
  PatchOrderTest() : problem_(View(), Config()), brute_(problem_.BruteForce(pool_)) {}
  static std::shared_ptr<const model::PlanningView> View() {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(5);
    scene.voxel = 0.1;
    scene.density = [](const Eigen::Vector3d& p) {
      return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return std::make_shared<model::PlanningView>(test_support::BuildView(scene));
  }
  static PlanningConfig Config() {
    PlanningConfig config;
    config.viewcell_size = 0.3;
    config.weights = {1, 2, 0.5, 1};
    return config;
  }
  Evaluation Evaluate(const HierarchyOptions& options, const parallel::Budget& budget,
                      parallel::Parallel& parallel) {
    return EvaluateByPatches(problem_.scoring->scorer(), problem_.feasible,
                             problem_.scoring->cells(), problem_.patches, problem_.grid, options,
                             budget, parallel, [this](const Evaluation&) { ++shown_; });
  }

  parallel::ThreadPool pool_{2};
  test_support::PlanningProblem problem_;
  std::vector<ViewScore> brute_;
  int shown_ = 0;
};

TEST_F(PatchOrderTest, EndsWithBruteForceScores) {
  ASSERT_GT(problem_.views.size(), 100u);
  for (const uint32_t leaf : {1u, 16u}) {
    HierarchyOptions options;
    options.leaf_views = leaf;
    const Evaluation evaluation = Evaluate(options, parallel::Budget::Unlimited(), pool_);
    EXPECT_TRUE(evaluation.complete);
    EXPECT_EQ(evaluation.exact, problem_.views.size());
    EXPECT_GT(shown_, 0);
    uint64_t rays = 0;
    for (size_t i = 0; i < brute_.size(); ++i) {
      ASSERT_NEAR(evaluation.views[i].score, brute_[i].score, 1e-6 * (1 + brute_[i].score));
      rays += brute_[i].rays;
    }
    EXPECT_LT(evaluation.rays, rays);
  }
}

TEST_F(PatchOrderTest, StoppedEarlyItsBoundsAreCertain) {
  const uint64_t all = Evaluate({}, parallel::Budget::Unlimited(), pool_).rays;
  double last_gap = 2;
  for (const double share : {0.02, 0.3, 0.8}) {
    parallel::Budget budget;
    budget.work_limit = static_cast<uint64_t>(share * static_cast<double>(all));
    parallel::Serial serial;
    const Evaluation one = Evaluate({}, budget, serial);
    const Evaluation two = Evaluate({}, budget, pool_);
    EXPECT_FALSE(one.complete);
    EXPECT_EQ(one.rays, two.rays);
    double upper = 0;
    double lower = 0;
    for (size_t i = 0; i < brute_.size(); ++i) {
      const ViewEstimate& view = one.views[i];
      ASSERT_LE(view.lower, brute_[i].score * (1 + 1e-6));
      ASSERT_GE(view.upper * (1 + 1e-6), brute_[i].score);
      ASSERT_EQ(view.score, two.views[i].score);
      upper = std::max(upper, view.upper);
      lower = std::max(lower, view.lower);
    }
    EXPECT_LT(1 - lower / upper, last_gap);
    last_gap = 1 - lower / upper;
  }
}

TEST_F(PatchOrderTest, StopsWhenCancelled) {
  std::stop_source stop;
  stop.request_stop();
  parallel::Budget budget;
  budget.cancelled = stop.get_token();
  const Evaluation evaluation = Evaluate({}, budget, pool_);
  EXPECT_FALSE(evaluation.complete);
  EXPECT_EQ(evaluation.rays, 0u);
}

}  // namespace
}  // namespace vantage::planning
