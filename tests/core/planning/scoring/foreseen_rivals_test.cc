// Views in sites that repeat themselves: what is said of them before anybody stands there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

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

registration::BoxScene PillarCorridor() {
  registration::BoxScene scene = registration::Corridor();
  const double half = scene.room.max().y();
  const double top = scene.room.max().z();
  for (double x = -59; x < 59; x += kBay) {
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
                                            const Eigen::Vector3d& at, double prior_sigma) {
    const auto model =
        registration::ModelFromScan(scene, registration::PoseAt({0, 0, 1.4}, 0), {}, 3);
    PlanningConfig config;
    config.registration.prior_sigma = prior_sigma;
    return EvaluateView(*model, sensor::ScannerModel{}, config, at, pool_).value().view.verdict;
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
  // 'say how good the priors are (0.55 m, ...'
  const std::vector<std::string> parts = absl::StrSplit(remedy, absl::ByAnyChar("( "));
  double sigma = 0;
  for (const std::string& part : parts) {
    if (absl::SimpleAtod(part, &sigma)) break;
  }
  ASSERT_GT(sigma, 0) << remedy;
  const registration::RegistrationVerdict verdict = Verdict(PillarCorridor(), kView, sigma);
  EXPECT_TRUE(verdict.registered()) << verdict.reason;
}

TEST_F(ForeseenRivals, WhereNothingRepeatsItselfAPriorMayBeMetresOff) {
  const registration::RegistrationVerdict verdict =
      Verdict(registration::FurnishedRoom(2), {0.5, -0.2, 1.45}, 2);
  EXPECT_TRUE(verdict.registered()) << verdict.reason;
}

}  // namespace
}  // namespace vantage::planning
