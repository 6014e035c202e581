// Views in sites that repeat themselves: what is said of them before anybody stands there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/registration/bound/verdict.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::planning {
namespace {

constexpr double kBay = 2.5;  // m
// Beside the middle, along which the model's scan looked out of range.
const Eigen::Vector3d kView(3, 0.4, 1.4);

registration::BoxScene PillarCorridor(double bay = kBay) {
  registration::BoxScene scene = registration::Corridor();
  const double half = scene.room.max().y();
  const double top = scene.room.max().z();
  for (double x = -59; x < 59; x += bay) {
    for (const double side : {-half, half - 0.3}) {
      scene.solids.emplace_back(Eigen::Vector3d(x, side, 0),
                                Eigen::Vector3d(x + 0.4, side + 0.3, top));
    }
  }
  return scene;
}

class ForeseenRivals : public testing::Test {
 protected:
  registration::RegistrationVerdict Verdict(const registration::BoxScene& scene,
                                            const Eigen::Vector3d& at, double prior_sigma,
                                            double heading_sigma = 0) {
    const auto model =
        registration::ModelFromScan(scene, registration::PoseAt({0, 0, 1.4}, 0), {}, 3);
    PlanningConfig config;
    config.registration.prior_sigma = prior_sigma;
    config.registration.prior_heading_sigma = heading_sigma;
    return EvaluateView(*model, sensor::ScannerModel{}, config, at, pool_).value().view.verdict;
  }
  // The number in front of some words of a remedy: 'say how good the priors are (0.55 m, ...'.
  static double NumberBefore(const std::string& words, const std::string& remedy) {
    const size_t end = remedy.find(words);
    if (end == std::string::npos) return 0;
    const std::vector<std::string> parts =
        absl::StrSplit(remedy.substr(0, end), absl::ByAnyChar("( "), absl::SkipEmpty());
    double number = 0;
    return !parts.empty() && absl::SimpleAtod(parts.back(), &number) ? number : 0;
  }

 private:
  parallel::ThreadPool pool_{2};
};

TEST_F(ForeseenRivals, AViewIsDoubtfulWhereItsPriorAllowsAnotherBay) {
  const registration::RegistrationVerdict verdict = Verdict(PillarCorridor(), kView, 1);
  EXPECT_EQ(verdict.outcome, registration::RegistrationOutcome::kDoubtful);
  EXPECT_THAT(verdict.bases, testing::ElementsAre(registration::RegistrationBasis::kRivalPose));
  EXPECT_THAT(verdict.reason, testing::HasSubstr("fit 2.5"));
  EXPECT_GT(verdict.error_bound, 0.95 * kBay);
}

TEST_F(ForeseenRivals, ThePriorThatTheRemedyAsksForHelps) {
  const std::string remedy = Verdict(PillarCorridor(), kView, 1).remedy;
  const double sigma = NumberBefore(" m, one sigma", remedy);
  ASSERT_GT(sigma, 0) << remedy;
  const registration::RegistrationVerdict verdict = Verdict(PillarCorridor(), kView, sigma);
  EXPECT_TRUE(verdict.registered()) << verdict.reason;
}

// A prior of two metres allows what lies nine metres off: farther than four thousand shifts of
// three voxels reach.
TEST_F(ForeseenRivals, AllThatAPriorAllowsIsLookedAt) {
  const registration::BoxScene scene = PillarCorridor(7);
  const registration::RegistrationVerdict verdict = Verdict(scene, kView, 2);
  EXPECT_EQ(verdict.outcome, registration::RegistrationOutcome::kDoubtful);
  EXPECT_THAT(verdict.bases, testing::ElementsAre(registration::RegistrationBasis::kRivalPose));
  EXPECT_GT(verdict.error_bound, 0.95 * 7);
  const registration::RegistrationVerdict sure = Verdict(scene, kView, 0.5);
  EXPECT_TRUE(sure.registered()) << sure.reason;
}

// A bare room is the same from the other side of its middle, turned by half.
TEST_F(ForeseenRivals, ARoomThatIsTheSameTurnedIsDoubtfulWhereNoHeadingIsKnown) {
  const Eigen::Vector3d at(0.8, -0.5, 1.4);
  const registration::RegistrationVerdict guessed = Verdict(registration::BareRoom(), at, 0);
  EXPECT_TRUE(guessed.registered()) << guessed.reason;
  const registration::RegistrationVerdict unknown =
      Verdict(registration::BareRoom(), at, 0, sensor::kPi);
  EXPECT_EQ(unknown.outcome, registration::RegistrationOutcome::kDoubtful);
  EXPECT_THAT(unknown.reason, testing::HasSubstr("turned by 180 degrees"));
  // It puts walls six metres from where they are.
  EXPECT_GT(unknown.error_bound, 5);
  // What the remedy asks for helps.
  const double degrees = NumberBefore(" degrees of heading", unknown.remedy);
  ASSERT_GT(degrees, 0) << unknown.remedy;
  const registration::RegistrationVerdict known =
      Verdict(registration::BareRoom(), at, 0, sensor::Radians(degrees));
  EXPECT_TRUE(known.registered()) << known.reason;
}

TEST_F(ForeseenRivals, FurnitureTellsWhichWayAScanIsTurned) {
  const registration::RegistrationVerdict verdict =
      Verdict(registration::FurnishedRoom(2), {0.5, -0.2, 1.45}, 0, sensor::kPi);
  EXPECT_TRUE(verdict.registered()) << verdict.reason;
}

// Each refusal's remedy: nearer to what is scanned.
TEST_F(ForeseenRivals, AStationNearerToWhatIsScannedHelpsWhereTheRemedySaysSo) {
  // Away from the station, until one is refused.
  registration::RegistrationVerdict nearer = Verdict(PillarCorridor(), kView, 0.05);
  EXPECT_TRUE(nearer.registered()) << nearer.reason;
  for (double x = 9; x < 20; x += 2) {
    const registration::RegistrationVerdict verdict =
        Verdict(PillarCorridor(), {x, 0.4, 1.4}, 0.05);
    if (verdict.registered()) {
      nearer = verdict;
      continue;
    }
    EXPECT_THAT(verdict.remedy, testing::HasSubstr("stand nearer to what is scanned already"))
        << x << " " << verdict.reason;
    EXPECT_GT(nearer.overlap_share, verdict.overlap_share);
    return;
  }
  FAIL() << "all register";
}

TEST_F(ForeseenRivals, OfAPlaceThatNoScanHasSeenIntoNothingIsSaid) {
  // Behind a wall across the room.
  registration::BoxScene scene = registration::BareRoom();
  scene.solids.emplace_back(Eigen::Vector3d(1.4, -2.5, 0), Eigen::Vector3d(1.6, 2.5, 2.7));
  const registration::RegistrationVerdict verdict = Verdict(scene, {2.3, 0.3, 1.4}, 0);
  EXPECT_EQ(verdict.outcome, registration::RegistrationOutcome::kDoubtful);
  EXPECT_THAT(verdict.reason, testing::HasSubstr("nothing can be said of a scan from there"));
  EXPECT_THAT(verdict.remedy, testing::HasSubstr("scan from a place that sees into it first"));
  EXPECT_EQ(verdict.overlap_share, 0);
}

TEST_F(ForeseenRivals, WhereNothingRepeatsItselfAPriorMayBeMetresOff) {
  const registration::RegistrationVerdict verdict =
      Verdict(registration::FurnishedRoom(2), {0.5, -0.2, 1.45}, 2);
  EXPECT_TRUE(verdict.registered()) << verdict.reason;
}

}  // namespace
}  // namespace vantage::planning
