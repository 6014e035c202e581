// Advice on targets, by what scans with these targets come to.
#include "core/planning/ranking/target_advice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::planning {
namespace {

using registration::BoxScene;

constexpr double kHeight = 1.4;  // m, of scanners
const registration::ScanSettings kSettings{sensor::Radians(0.3), 0.003, sensor::Radians(-60), {}};

// A model of one scan in the middle of a scene, and what becomes of scans beside it. Along the axis
// of a corridor without ends rays do not come back, so that views stand beside it.
class TargetAdviceTest : public testing::Test {
 protected:
  void Model(const BoxScene& scene, const PlanningConfig& config) {
    scene_ = scene;
    model_ = registration::ModelFromScan(scene, At(0, 0), kSettings, 3);
    scanner_ = sensor::ScannerModel();
    scanner_.azimuth_step = scanner_.elevation_step = kSettings.step;
    problem_ = PlanningProblem::Prepare({*model_, scanner_, config}, pool_).value();
  }
  static Eigen::Isometry3d At(double x, double y) {
    return registration::PoseAt({x, y, kHeight}, 0);
  }
  RankedView View(double x, double y) const {
    RankedView view;
    view.position = {x, y, kHeight};
    view.verdict = problem_->overlap()
                       .Predict(view.position, problem_->scene(), problem_->config().registration,
                                parallel::Budget::Unlimited())
                       ->verdict;
    return view;
  }
  std::optional<TargetAdvice> Find(const RankedView& view, const RankedView* next = nullptr) const {
    uint64_t rays = 0;
    return FindTargets(*problem_, view, next, parallel::Budget::Unlimited(), rays);
  }
  // A scan from a view that sees targets where the advice has them, measured to 2 mm, from a prior
  // that is `off` along x (m) and says so.
  registration::RegistrationResult ScanWith(const RankedView& view,
                                            const std::vector<TargetPlace>& places, double off) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> millimetres(0, 0.001);
    const Eigen::Isometry3d truth =
        registration::PoseAt(view.position + Eigen::Vector3d(0.02, -0.03, 0), 0.4);
    std::vector<registration::TargetTie> ties;
    for (const TargetPlace& place : places) {
      const Eigen::Vector3d noise(millimetres(random), millimetres(random), millimetres(random));
      ties.push_back({std::to_string(ties.size()), truth.inverse() * place.position + noise,
                      place.position, 0.002});
    }
    sensor::PosePrior prior;
    prior.T_world_scan = truth;
    prior.T_world_scan.translation().x() += off;
    sensor::Vector6d sigma;
    sigma << 0.02, 0.02, 0.1, std::max(0.1, std::abs(off)), 0.1, 0.05;
    prior.covariance = sigma.cwiseAbs2().asDiagonal();
    const auto result = registration::RegisterWithTargets(
        *model_, registration::ScanScene(scene_, truth, kSettings, 11), prior, ties,
        problem_->config().registration, pool_);
    EXPECT_TRUE(result.ok()) << result.status();
    off_ = (result->T_world_scan.translation() - truth.translation()).norm();
    return *result;
  }

  parallel::ThreadPool pool_{2};
  BoxScene scene_;
  std::shared_ptr<const model::PlanningView> model_;
  sensor::ScannerModel scanner_;
  std::shared_ptr<const PlanningProblem> problem_;
  double off_ = 0;  // m, of the last scan
};

// Each place is on a wall of the corridor, within reach, and apart from the others.
void ExpectOnWalls(const TargetAdvice& advice) {
  ASSERT_GE(advice.places.size(), 2u);
  ASSERT_LE(advice.places.size(), 4u);
  for (size_t i = 0; i < advice.places.size(); ++i) {
    const Eigen::Vector3d& at = advice.places[i].position;
    EXPECT_NEAR(std::abs(at.y()), 1, 0.05);
    EXPECT_GE(at.z(), 0.45);
    EXPECT_LE(at.z(), 2.05);
    for (size_t k = 0; k < i; ++k) EXPECT_GE((at - advice.places[k].position).norm(), 1.0);
  }
}

TEST_F(TargetAdviceTest, CuresABareCorridor) {
  PlanningConfig config;
  config.scanned_from = {{"sessions/job/scans/first", {0, 0, kHeight}, 0}};
  Model(registration::Corridor(), config);
  const RankedView view = View(3, 0.3);
  ASSERT_FALSE(view.verdict.registered());
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value());
  ExpectOnWalls(*advice);
  EXPECT_EQ(advice->seen_from, std::vector<std::string>{"sessions/job/scans/first"});
  EXPECT_FALSE(advice->first_view.has_value());
  EXPECT_LE(advice->error_bound, config.registration.required_accuracy);
  const std::string words = TargetAdviceWords(*advice, {100, 0, 0});
  EXPECT_NE(words.find("put up"), std::string::npos) << words;
  EXPECT_NE(words.find("the station of first"), std::string::npos) << words;

  EXPECT_FALSE(ScanWith(view, {}, 0.2).verdict.registered());
  const registration::RegistrationResult with = ScanWith(view, advice->places, 0.2);
  EXPECT_TRUE(with.verdict.registered()) << with.verdict.reason;
  EXPECT_LT(off_, with.verdict.error_bound);
  EXPECT_LT(with.verdict.error_bound, 1.5 * advice->error_bound);
}

TEST_F(TargetAdviceTest, PrefersTheScanThatComesNextAnyway) {
  Model(registration::Corridor(), {});
  const RankedView view = View(3, 0.3);
  RankedView next = View(1.5, 0.3);
  next.verdict.error_bound = 0.004;
  const std::optional<TargetAdvice> advice = Find(view, &next);
  ASSERT_TRUE(advice.has_value());
  EXPECT_EQ(advice->first_view, 0u);
  EXPECT_TRUE(advice->seen_from.empty());
  EXPECT_NE(TargetAdviceWords(*advice, {0, 0, 0}).find("rank 1"), std::string::npos);
  // What the pose of that scan leaves open is in the bound.
  RankedView vague = next;
  vague.verdict.error_bound = 0.012;
  const std::optional<TargetAdvice> other = Find(view, &vague);
  if (other.has_value() && other->first_view.has_value()) {
    EXPECT_GT(other->places.size(), advice->places.size());
  }
}

TEST_F(TargetAdviceTest, NamesTheTargetsOfAControlNetwork) {
  PlanningConfig config;
  config.targets = {{"A", {2.2, 0.95, 1.2}, 0.002},
                    {"B", {4.6, 0.95, 1.6}, 0.002},
                    {"far", {16, 0.95, 1.6}, 0.002}};
  Model(registration::Corridor(), config);
  const RankedView view = View(3, 0.3);
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value());
  ASSERT_EQ(advice->places.size(), 2u);
  for (const TargetPlace& place : advice->places) {
    EXPECT_TRUE(place.target == "A" || place.target == "B") << place.target;
    EXPECT_FALSE(place.normal.has_value());
  }
  EXPECT_TRUE(advice->seen_from.empty());
  const std::string words = TargetAdviceWords(*advice, {0, 0, 0});
  EXPECT_NE(words.find("'A'"), std::string::npos) << words;
  EXPECT_EQ(words.find("put up"), std::string::npos) << words;
  EXPECT_TRUE(ScanWith(view, advice->places, 0.2).verdict.registered());
}

// Behind a pillar a target is not seen, and two in one place tell no more than one.
TEST_F(TargetAdviceTest, DoesNotCountTargetsThatTheViewCannotUse) {
  BoxScene scene = registration::Corridor();
  scene.solids.push_back({Eigen::Vector3d(1.6, -1, 0), Eigen::Vector3d(2.0, 0.1, 2.5)});
  PlanningConfig config;
  config.targets = {{"hidden", {1.2, -0.95, 1.2}, 0.002},
                    {"A", {3.4, 0.95, 1.2}, 0.002},
                    {"beside A", {3.6, 0.95, 1.2}, 0.002}};
  Model(scene, config);
  RankedView view = View(3, 0.3);
  view.verdict.outcome = registration::RegistrationOutcome::kDoubtful;
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value());
  for (const TargetPlace& place : advice->places) EXPECT_NE(place.target, "hidden");
  size_t beside = 0;
  for (const TargetPlace& place : advice->places) beside += place.target.empty() ? 0 : 1;
  EXPECT_LE(beside, 1u);
}

// Pillars each two metres, and priors that may be a bay off.
TEST_F(TargetAdviceTest, TellsTwinsApart) {
  BoxScene scene = registration::Corridor();
  for (double x = -58; x < 59; x += 2) {
    for (const double y : {-1.0, 0.8}) {
      scene.solids.push_back({Eigen::Vector3d(x, y, 0), Eigen::Vector3d(x + 0.25, y + 0.2, 2.5)});
    }
  }
  PlanningConfig config;
  config.registration.prior_sigma = 1;
  Model(scene, config);
  const RankedView view = View(2.9, 0.3);
  ASSERT_FALSE(view.verdict.registered());
  ASSERT_EQ(view.verdict.bases.front(), registration::RegistrationBasis::kRivalPose)
      << view.verdict.reason;
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value());
  EXPECT_FALSE(ScanWith(view, {}, 1.2).verdict.registered());
  const registration::RegistrationResult with = ScanWith(view, advice->places, 1.2);
  EXPECT_TRUE(with.verdict.registered()) << with.verdict.reason;
  EXPECT_LT(off_, 0.01);
}

// m, least distance of a place from a line through two others; infinite of two places.
double LeastOffLine(const TargetAdvice& advice) {
  double least = std::numeric_limits<double>::infinity();
  const std::vector<TargetPlace>& places = advice.places;
  for (size_t i = 0; i < places.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      const Eigen::Vector3d along = (places[k].position - places[i].position).normalized();
      for (size_t l = 0; l < places.size(); ++l) {
        if (l == i || l == k) continue;
        least = std::min(least, along.cross(places[l].position - places[i].position).norm());
      }
    }
  }
  return least;
}

// Along a wall the four that hold a view best lie nearly on one line.
TEST_F(TargetAdviceTest, NoThreeLieInALine) {
  PlanningConfig config;
  config.registration.required_accuracy = 0.005;
  Model(registration::Corridor(), config);
  int advised = 0;
  for (const double x : {2.4, 2.5, 2.6}) {
    const std::optional<TargetAdvice> advice = Find(View(x, 0.3));
    if (!advice.has_value()) continue;
    ++advised;
    EXPECT_GE(LeastOffLine(*advice), 0.3) << "at " << x;
  }
  EXPECT_GT(advised, 0);
}

// A flight of which both ends are out of range: one step up it looks the same.
BoxScene Stairs() {
  constexpr double kTread = 0.28;
  constexpr double kRise = 0.17;
  constexpr int kSteps = 40;
  BoxScene scene;
  scene.room = {Eigen::Vector3d(-100, -0.8, -100), Eigen::Vector3d(100, 0.8, 100)};
  for (int k = -kSteps; k < kSteps; ++k) {
    const double x = kTread * k;
    const double floor = kRise * k;
    scene.solids.push_back(
        {Eigen::Vector3d(x, -0.8, floor - 1), Eigen::Vector3d(x + kTread, 0.8, floor)});
    scene.solids.push_back(
        {Eigen::Vector3d(x, -0.8, floor + 2.5), Eigen::Vector3d(x + kTread, 0.8, floor + 3.5)});
  }
  return scene;
}

// Five steps up, by who knows to 0.3 m where that is: the step above would do as well.
TEST_F(TargetAdviceTest, OnStairsTargetsTellTheSteps) {
  PlanningConfig config;
  config.registration.prior_sigma = 0.3;
  config.registration.required_accuracy = 0.03;
  config.scanned_from = {{"sessions/job/scans/foot", {0, 0, kHeight}, 0}};
  Model(Stairs(), config);
  RankedView view;
  view.position = {5.5 * 0.28, 0.3, kHeight + 5 * 0.17};
  view.verdict = problem_->overlap()
                     .Predict(view.position, problem_->scene(), config.registration,
                              parallel::Budget::Unlimited())
                     ->verdict;
  ASSERT_FALSE(view.verdict.registered());
  EXPECT_EQ(view.verdict.bases.front(), registration::RegistrationBasis::kRivalPose)
      << view.verdict.reason;
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value()) << view.verdict.reason;
  EXPECT_EQ(advice->seen_from, std::vector<std::string>{"sessions/job/scans/foot"});
  for (const TargetPlace& place : advice->places) {
    EXPECT_NEAR(std::abs(place.position.y()), 0.8, 0.05) << "on the side walls";
    const double tread = 0.17 * std::floor(place.position.x() / 0.28);
    EXPECT_GE(place.position.z() - tread, 0.3);
    EXPECT_LE(place.position.z() - tread, 2.3);
  }
  EXPECT_FALSE(ScanWith(view, {}, 0.28).verdict.registered());
  const registration::RegistrationResult with = ScanWith(view, advice->places, 0.28);
  EXPECT_TRUE(with.verdict.registered()) << with.verdict.reason;
  EXPECT_LT(off_, with.verdict.error_bound);
}

// Floor and ceiling of a passage; its sides are of glass, of which nothing comes back.
BoxScene GlassPassage(bool one_wall) {
  BoxScene scene;
  scene.room = {Eigen::Vector3d(-100, -100, -100), Eigen::Vector3d(100, 100, 100)};
  scene.solids = {{Eigen::Vector3d(-30, -1, -0.2), Eigen::Vector3d(30, 1, 0)},
                  {Eigen::Vector3d(-30, -1, 2.5), Eigen::Vector3d(30, 1, 2.7)}};
  if (one_wall) {
    scene.solids.push_back({Eigen::Vector3d(-30, 1, 0), Eigen::Vector3d(30, 1.2, 2.5)});
  }
  return scene;
}

TEST_F(TargetAdviceTest, BesideGlassTheyGoOnTheOtherWall) {
  Model(GlassPassage(true), {});
  const RankedView view = View(3, 0.3);
  ASSERT_FALSE(view.verdict.registered());
  const std::optional<TargetAdvice> advice = Find(view);
  ASSERT_TRUE(advice.has_value()) << view.verdict.reason;
  for (const TargetPlace& place : advice->places) EXPECT_NEAR(place.position.y(), 1, 0.05);
  EXPECT_GE(LeastOffLine(*advice), 0.3);
  EXPECT_EQ(TargetAdviceWords(*advice, {0, 0, 0}).find("stand"), std::string::npos);
  EXPECT_FALSE(ScanWith(view, {}, 0.2).verdict.registered());
  EXPECT_TRUE(ScanWith(view, advice->places, 0.2).verdict.registered());
  EXPECT_LT(off_, 0.01);
}

TEST_F(TargetAdviceTest, SaysNothingWhereTargetsAreNotWhatIsWanting) {
  Model(registration::FurnishedRoom(3), {});
  RankedView view = View(0.8, 0.6);
  EXPECT_FALSE(Find(view).has_value()) << "registers by itself";
  view.verdict.outcome = registration::RegistrationOutcome::kDoubtful;
  view.verdict.overlap_share = 0.05;
  EXPECT_FALSE(Find(view).has_value()) << "overlaps too little";
}

// Three in one passage, and those that lie elsewhere after them.
TEST_F(TargetAdviceTest, OtherPassagesGetItToo) {
  Model(registration::Corridor(), {});
  Plan plan;
  for (const double x : {3.0, 2.6, 3.4, 3.2, -3.0, -2.8}) plan.refused.push_back(View(x, 0.3));
  AdviseTargets(*problem_, parallel::Budget::Unlimited(), plan);
  EXPECT_FALSE(plan.refused[3].targets.has_value());
  EXPECT_TRUE(plan.refused[4].targets.has_value());
  EXPECT_FALSE(plan.refused[5].targets.has_value());
}

TEST_F(TargetAdviceTest, TheBestRefusedViewsOfAPlanGetIt) {
  Model(registration::Corridor(), {});
  Plan plan;
  for (const double x : {3.0, 2.6, 3.4, 3.2}) plan.refused.push_back(View(x, 0.3));
  const uint64_t rays = AdviseTargets(*problem_, parallel::Budget::Unlimited(), plan);
  EXPECT_GT(rays, 0u);
  for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(plan.refused[i].targets.has_value()) << i;
  EXPECT_FALSE(plan.refused[3].targets.has_value());
  // The same again, and on one thread.
  Plan again;
  for (const double x : {3.0, 2.6, 3.4, 3.2}) again.refused.push_back(View(x, 0.3));
  AdviseTargets(*problem_, parallel::Budget::Unlimited(), again);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(again.refused[i].targets->places.size(), plan.refused[i].targets->places.size());
    for (size_t k = 0; k < plan.refused[i].targets->places.size(); ++k) {
      EXPECT_EQ(again.refused[i].targets->places[k].position,
                plan.refused[i].targets->places[k].position);
    }
  }
  parallel::Budget over = parallel::Budget::Unlimited();
  over.deadline = parallel::Budget::Clock::time_point::min();
  Plan late;
  for (const double x : {3.0, 2.6}) late.refused.push_back(View(x, 0.3));
  Plan registers = late;
  registers.views.push_back(View(1.5, 0.3));
  AdviseTargets(*problem_, over, late);
  EXPECT_TRUE(late.refused[0].targets.has_value()) << "nothing else registers";
  EXPECT_FALSE(late.refused[1].targets.has_value());
  AdviseTargets(*problem_, over, registers);
  EXPECT_FALSE(registers.refused[0].targets.has_value());
}

}  // namespace
}  // namespace vantage::planning
