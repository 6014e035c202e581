// Step F of a scanner that sees a sector: each heading by itself against all of them at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/ranking/optimality_gap.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

sensor::ScannerModel SectorScanner(double degrees) {
  sensor::ScannerModel scanner;
  scanner.azimuth_span = sensor::Radians(degrees);
  return scanner;
}

// `accuracy`, m: so that some headings register and others don't.
struct SectorRoom : test_support::PlanningProblem {
  SectorRoom(const test_support::ClosedFormScene& scene, double span, double accuracy)
      : test_support::PlanningProblem(
            std::make_shared<model::PlanningView>(test_support::BuildView(scene)), Config(accuracy),
            SectorScanner(span)),
        overlap(problem->overlap()) {}
  static PlanningConfig Config(double accuracy) {
    PlanningConfig config;
    config.viewcell_size = 0.3;
    config.registration.required_accuracy = accuracy;
    config.registration.minimum_overlap = 0.2;
    return config;
  }
  std::vector<double> ByHeading(const Eigen::Vector3d& view) const {
    std::vector<double> by_heading(scoring->scorer().headings().size());
    scoring->scorer().ScoreHeadings(view, scoring->cells(), parallel::Budget::Unlimited(),
                                    by_heading);
    return by_heading;
  }
  // Of the headings that gain something and have this outcome, judged one by one, the one of most
  // gain.
  std::optional<size_t> Best(const Eigen::Vector3d& view, std::span<const double> by_heading,
                             registration::RegistrationOutcome outcome =
                                 registration::RegistrationOutcome::kRegistered) const {
    std::optional<size_t> best;
    for (size_t i = 0; i < by_heading.size(); ++i) {
      if (!(by_heading[i] > 0) || (best.has_value() && by_heading[i] <= by_heading[*best]))
        continue;
      const auto seen = overlap.Predict(view, scoring->scene(), config.registration,
                                        parallel::Budget::Unlimited(), nullptr,
                                        scoring->scorer().headings().Angle(i));
      if (seen->verdict.outcome == outcome) best = i;
    }
    return best;
  }
  const OverlapSurface& overlap;
};

// A room of which one wall is known only: towards it there is overlap, away from it none.
test_support::ClosedFormScene OneKnownWall() {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(4);
  const auto solid = scene.solid;
  scene.solid = [solid](const Eigen::Vector3d& p) { return solid(p) && p.x() < 0; };
  scene.known = [solid](const Eigen::Vector3d& p) { return !solid(p); };
  return scene;
}

// The share of a scan from the middle, towards +x, that overlaps what stands at x = 1.
double ShareTowards(const std::function<bool(double y)>& stands,
                    const sensor::ScannerModel& scanner) {
  test_support::ClosedFormScene scene;
  scene.extent = {Eigen::Vector3d(-1, -2, 0), Eigen::Vector3d(2, 2, 2.5)};
  scene.solid = [&](const Eigen::Vector3d& p) { return p.x() > 1 && p.x() < 1.1 && stands(p.y()); };
  const model::PlanningView model = test_support::BuildView(scene);
  parallel::Serial serial;
  const visibility::OpaqueGrid grid(model);
  const auto occlusion = visibility::OcclusionScene::Create(grid, serial).value();
  return OverlapSurface::Create(model, grid, occlusion, scanner, serial)
      ->Predict({0, 0, 1.25}, occlusion, {}, parallel::Budget::Unlimited(), nullptr, 0)
      ->verdict.overlap_share;
}

// An alignment finds no plane in a fence of posts 10 cm wide: it holds no scan of a sector.
TEST(SectorCheckTest, EdgesAreNoOverlap) {
  const auto wall = [](double) { return true; };
  const auto fence = [](double y) { return std::fmod(y + 4, 0.2) < 0.1; };
  EXPECT_GT(ShareTowards(wall, SectorScanner(120)), 0.4);
  EXPECT_GT(ShareTowards(fence, sensor::ScannerModel{}), 0.05);
  EXPECT_EQ(ShareTowards(fence, SectorScanner(120)), 0);
}

TEST(SectorCheckTest, TheVerdictIsThatOfWhatTheSectorSees) {
  const SectorRoom room(OneKnownWall(), 90, 0.01);
  const Eigen::Vector3d view(3, 1.5, 1.5);
  const auto share = [&](double heading) {
    return room.overlap
        .Predict(view, room.scoring->scene(), room.config.registration,
                 parallel::Budget::Unlimited(), nullptr, heading)
        ->verdict.overlap_share;
  };
  // Towards the wall, which fills about 44 of 150 degrees of elevation over 72 of 90 degrees of
  // azimuth, less what stands before it.
  EXPECT_GT(share(sensor::kPi), 0.15);
  EXPECT_LT(share(sensor::kPi), 0.25);
  EXPECT_EQ(share(0), 0);  // away from it
  EXPECT_GT(share(sensor::kPi / 2 + 0.3), 0.02);
  EXPECT_LT(share(sensor::kPi / 2 + 0.3), share(sensor::kPi));
}

// Where none registers, of those that may: a person decides.
TEST(SectorCheckTest, FindsTheHeadingOfMostGainThatRegisters) {
  int other_than_best = 0;
  int none = 0;
  for (const double accuracy : {0.0035, 0.0056, 0.014}) {
    const SectorRoom room(test_support::FurnishedRoom(3), 75, accuracy);
    ASSERT_GT(room.views.size(), 100u);
    for (size_t v = 0; v < room.views.size(); v += room.views.size() / 12) {
      const std::vector<double> by_heading = room.ByHeading(room.views[v]);
      const auto seen =
          room.overlap.PredictBest(room.views[v], by_heading, room.scoring->scene(),
                                   room.config.registration, parallel::Budget::Unlimited());
      ASSERT_TRUE(seen.has_value());
      const std::optional<size_t> best = room.Best(room.views[v], by_heading);
      ASSERT_EQ(seen->verdict.registered(), best.has_value());
      if (!best.has_value()) {
        ++none;
        const std::optional<size_t> doubtful =
            room.Best(room.views[v], by_heading, registration::RegistrationOutcome::kDoubtful);
        EXPECT_EQ(by_heading[seen->heading],
                  by_heading[doubtful.value_or(BestOf(by_heading).heading)]);
        continue;
      }
      EXPECT_EQ(by_heading[seen->heading], by_heading[*best]);
      other_than_best += *best != BestOf(by_heading).heading;
    }
  }
  EXPECT_GT(other_than_best, 2);
  EXPECT_GT(none, 2);
  std::printf("%d views register with another heading than the best, %d with none\n",
              other_than_best, none);
}

TEST(SectorCheckTest, ReturnsTheBestOfAllCandidatesWithTheHeadingsThatRegister) {
  const SectorRoom room(test_support::FurnishedRoom(3), 75, 0.0084);
  Evaluation evaluation;
  for (const Eigen::Vector3d& view : room.views) {
    const BestHeading best = BestOf(room.ByHeading(view));
    evaluation.views.push_back({best.score, best.score, best.score, true, true, 0, best.heading});
  }
  evaluation.complete = true;
  const std::vector<uint32_t> candidates =
      RankViews(evaluation, room.feasible, room.config.candidate_separation, 60);
  ASSERT_GT(candidates.size(), 8u);
  std::vector<double> scores;
  for (const uint32_t i : candidates) {
    const std::vector<double> by_heading = room.ByHeading(room.views[i]);
    const std::optional<size_t> best = room.Best(room.views[i], by_heading);
    if (best.has_value()) scores.push_back(by_heading[*best]);
  }
  std::sort(scores.rbegin(), scores.rend());
  constexpr size_t kWanted = 4;
  ASSERT_GT(scores.size(), kWanted);
  parallel::ThreadPool pool(3);
  const RegistrationCheck check =
      CheckRegistration(*room.problem, room.overlap, evaluation, candidates, kWanted,
                        parallel::Budget::Unlimited(), pool);
  EXPECT_TRUE(check.finished);
  ASSERT_EQ(check.registrable.size(), kWanted);
  for (size_t k = 0; k < kWanted; ++k) {
    // Views beside doubtful ones may be better than any candidate.
    EXPECT_GE(check.registrable[k].score, scores[k] * (1 - 1e-9));
    const auto seen = room.overlap.Predict(
        room.views[check.registrable[k].view], room.scoring->scene(), room.config.registration,
        parallel::Budget::Unlimited(), nullptr,
        room.scoring->scorer().headings().Angle(*check.registrable[k].heading));
    EXPECT_TRUE(seen->verdict.registered());
  }
  // No view that was checked is held to promise more than it gains.
  std::vector<RankedView> returned(1);
  returned[0].lower = check.registrable[0].score;
  double most = 0;
  for (uint32_t i = 0; i < room.views.size(); ++i) most = std::max(most, evaluation.views[i].upper);
  EXPECT_LE(OptimalityGap(*room.problem, evaluation, check, returned),
            1 - returned[0].lower / most);
}

}  // namespace
}  // namespace vantage::planning
