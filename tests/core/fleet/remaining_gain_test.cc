#include "core/fleet/remaining_gain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/fleet/claim_cover.h"
#include "core/fleet/lazy_gains.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::fleet {
namespace {

class RemainingGainTest : public ::testing::Test {
 protected:
  static planning::PlanningConfig Config() {
    planning::PlanningConfig config;
    config.viewcell_size = 0.4;
    config.max_viewpoint_height = 1.7;
    return config;
  }
  RemainingGainTest()
      : problem_(std::make_shared<model::PlanningView>(
                     test_support::BuildView(test_support::FurnishedRoom(2))),
                 Config()) {
    other_.elevation_step = other_.azimuth_step = sensor::Radians(0.5);
    other_.range_max = 4;
  }

  // t(v, A) of every cell, as if nothing else had been chosen.
  std::vector<double> Gains(const Eigen::Vector3d& view,
                            const sensor::ScannerModel& scanner) const {
    const planning::SensingConstraints constraints(scanner);
    const planning::BruteForceScorer scorer(constraints, problem_.scoring->scene(),
                                            problem_.model->voxel_size());
    std::vector<float> gains(problem_.scoring->cells().size());
    scorer.ScoreCells(view, problem_.scoring->cells(), parallel::Budget::Unlimited(), gains);
    return {gains.begin(), gains.end()};
  }

  test_support::PlanningProblem problem_;
  sensor::ScannerModel other_;
};

// What a set of views gains is, cell by cell, what the best of them does.
double Together(const std::vector<std::vector<double>>& views) {
  double sum = 0;
  for (size_t i = 0; i < views.front().size(); ++i) {
    double best = 0;
    for (const auto& gains : views) best = std::max(best, gains[i]);
    sum += best;
  }
  return sum;
}

TEST_F(RemainingGainTest, MarginalGainsAreThoseOfBruteForce) {
  ASSERT_GT(problem_.views.size(), 50u);
  std::mt19937 random(5);
  const planning::SensingConstraints constraints(other_);
  const planning::BruteForceScorer of_other(constraints, problem_.scoring->scene(),
                                            problem_.model->voxel_size());
  for (int run = 0; run < 6; ++run) {
    SCOPED_TRACE(run);
    RemainingGain remaining(problem_.scoring->cells());
    uint64_t rays = 0;
    std::vector<std::vector<double>> chosen;
    double so_far = 0;
    const Eigen::Vector3d probe = problem_.views[random() % problem_.views.size()];
    const std::vector<double> probe_gains = Gains(probe, problem_.scanner);
    double lazy = problem_.scoring->scorer()
                      .Score(probe, problem_.scoring->cells(), parallel::Budget::Unlimited())
                      .score;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d view = problem_.views[random() % problem_.views.size()];
      const bool unlike = k % 2 == 1;
      chosen.push_back(Gains(view, unlike ? other_ : problem_.scanner));
      const double all = Together(chosen);
      const auto gained = remaining.Take(view, unlike ? of_other : problem_.scoring->scorer(),
                                         parallel::Budget::Unlimited(), rays);
      ASSERT_TRUE(gained.has_value());
      EXPECT_NEAR(*gained, all - so_far, 1e-4 * all);
      so_far = all;
      // The probe's marginal gain: all at once on what is left, and step by step.
      auto with_probe = chosen;
      with_probe.push_back(probe_gains);
      const double marginal = Together(with_probe) - all;
      const double left = problem_.scoring->scorer()
                              .Score(probe, remaining.left(), parallel::Budget::Unlimited())
                              .score;
      EXPECT_NEAR(left, marginal, 1e-4 * all);
      lazy -= remaining
                  .Lowered(remaining.steps() - 1, probe, problem_.scoring->scorer(),
                           parallel::Budget::Unlimited(), rays)
                  .value();
      EXPECT_NEAR(lazy, marginal, 1e-4 * all);
    }
    EXPECT_GT(rays, 0u);
    // The second scan from the same place gains nothing.
    const size_t before = remaining.left().size();
    EXPECT_NEAR(
        remaining.Take(probe, problem_.scoring->scorer(), parallel::Budget::Unlimited(), rays)
            .value(),
        lazy, 1e-4 * so_far);
    EXPECT_LE(remaining.left().size(), before);
    EXPECT_NEAR(
        remaining.Take(probe, problem_.scoring->scorer(), parallel::Budget::Unlimited(), rays)
            .value(),
        0, 1e-4 * so_far);
  }
}

TEST_F(RemainingGainTest, LazyGainsAreBoundsUntilTheyAreFresh) {
  planning::Evaluation evaluation;
  for (const planning::ViewScore& score : problem_.BruteForce(problem_.serial)) {
    evaluation.views.push_back({score.score, score.score, score.score, true, true, 0});
  }
  evaluation.complete = true;
  RemainingGain remaining(problem_.scoring->cells());
  LazyGains gains(problem_.views, problem_.scoring->scorer(), remaining, evaluation);
  uint64_t rays = 0;
  for (uint32_t i = 0; i < problem_.views.size(); ++i) EXPECT_TRUE(gains.Fresh(i));
  for (const size_t view : {size_t{3}, problem_.views.size() / 2}) {
    ASSERT_TRUE(remaining.Take(problem_.views[view], problem_.scoring->scorer(),
                               parallel::Budget::Unlimited(), rays));
  }
  std::vector<uint32_t> all;
  for (uint32_t i = 0; i < problem_.views.size(); ++i) all.push_back(i);
  std::vector<double> bounds;
  for (const uint32_t i : all) {
    EXPECT_FALSE(gains.Fresh(i));
    bounds.push_back(gains.Upper(i));
  }
  ASSERT_TRUE(gains.Refresh(all, parallel::Budget::Unlimited(), problem_.serial, rays));
  for (const uint32_t i : all) {
    EXPECT_TRUE(gains.Fresh(i));
    const double exact =
        problem_.scoring->scorer()
            .Score(problem_.views[i], remaining.left(), parallel::Budget::Unlimited())
            .score;
    EXPECT_NEAR(gains.Value(i), exact, 1e-4 * bounds[i]);
    EXPECT_LE(exact, bounds[i] * (1 + 1e-5));
  }
}

TEST_F(RemainingGainTest, CoverIsTheShareThatClaimsLeaveNothingOf) {
  const Eigen::Vector3d view = problem_.views[7];
  const std::vector<PledgedView> claims = {{problem_.views[8], problem_.scanner},
                                           {problem_.views.back(), other_}};
  const auto covered = MeasureCover(*problem_.model, problem_.scanner, problem_.config, view,
                                    claims, problem_.serial);
  ASSERT_TRUE(covered.ok()) << covered.status();
  const auto own = Gains(view, problem_.scanner);
  const auto first = Gains(claims[0].position, problem_.scanner);
  const auto second = Gains(claims[1].position, other_);
  const double gain = Together({own});
  EXPECT_NEAR(covered->score, gain, 1e-4 * gain);
  EXPECT_NEAR(covered->left, Together({own, first, second}) - Together({first, second}),
              1e-4 * gain);
  EXPECT_NEAR(covered->cover.together, 1 - covered->left / covered->score, 1e-6);
  ASSERT_EQ(covered->cover.by_claim.size(), 2u);
  EXPECT_NEAR(covered->cover.by_claim[0], 1 - (Together({own, first}) - Together({first})) / gain,
              1e-4);
  EXPECT_NEAR(covered->cover.by_claim[1], 1 - (Together({own, second}) - Together({second})) / gain,
              1e-4);
  EXPECT_GT(covered->cover.by_claim[0], 0.3) << "they are neighbours";
  const auto nobody =
      MeasureCover(*problem_.model, problem_.scanner, problem_.config, view, {}, problem_.serial);
  EXPECT_EQ(nobody->cover.together, 0);
  EXPECT_EQ(nobody->left, nobody->score);
}

}  // namespace
}  // namespace vantage::fleet
