#include "core/planning/planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/registration/bound/prediction.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using ::testing::HasSubstr;

class PlannerTest : public ::testing::Test {
 protected:
  PlannerTest() { config_.viewcell_size = 0.2; }
  Plan Make(const model::PlanningView& model, const parallel::Budget& budget,
            parallel::Parallel& parallel) {
    absl::StatusOr<Plan> plan =
        MakePlan(model, scanner_, config_, budget, parallel, [this](const Plan&) { ++shown_; });
    EXPECT_TRUE(plan.ok()) << plan.status();
    return plan.ok() ? *std::move(plan) : Plan{};
  }
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
  int shown_ = 0;
};

// A plan to the end in a room whose far corner is unknown.
class WholePlanTest : public PlannerTest {
 protected:
  WholePlanTest() : model_(test_support::BuildView(Room())) {}
  void SetUp() override {
    plan_ = Make(model_, parallel::Budget::Unlimited(), serial_);
    ASSERT_EQ(plan_.outcome, PlanOutcome::kViews) << plan_.message;
    ASSERT_GE(plan_.views.size(), 3u);
  }
  // Surface that the station sees has the density that a scan from there gives it.
  static test_support::ClosedFormScene Room() {
    test_support::ClosedFormScene scene = test_support::FurnishedRoom(2);
    scene.density = [](const Eigen::Vector3d& p) {
      return 60000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
    };
    return scene;
  }
  model::PlanningView model_;
  Plan plan_;
};

TEST_F(WholePlanTest, FindsTheViewBehindTheScreen) {
  // The unknown corner holds most of what is missing; the station does not see it.
  const absl::StatusOr<ViewEvaluation> station =
      EvaluateView(model_, scanner_, config_, model_.stations()[0].position, serial_);
  ASSERT_TRUE(station.ok());
  EXPECT_GT(plan_.views[0].score, 1.5 * station->view.score);
}

TEST_F(WholePlanTest, IsCompleteAndExact) {
  EXPECT_GT(shown_, 0);
  EXPECT_TRUE(plan_.complete);
  EXPECT_EQ(plan_.confidence, 1);
  EXPECT_EQ(plan_.optimality_gap, 0);
  EXPECT_EQ(plan_.model_version, model_.version());
  EXPECT_EQ(plan_.score_map.size(), plan_.feasible_cells);
  EXPECT_TRUE(plan_.termination.unobservable_known);
  for (const RankedView& view : plan_.views) EXPECT_TRUE(view.exact);
}

TEST_F(WholePlanTest, ViewsComeByScoreAndLieApart) {
  EXPECT_LE(plan_.views.size(), static_cast<size_t>(config_.candidates));
  for (size_t i = 1; i < plan_.views.size(); ++i) {
    EXPECT_LE(plan_.views[i].score, plan_.views[i - 1].score);
    for (size_t j = 0; j < i; ++j) {
      EXPECT_GE((plan_.views[j].position - plan_.views[i].position).norm(),
                config_.candidate_separation);
    }
  }
}

TEST_F(WholePlanTest, ScoresByKindSumToTheScore) {
  for (const RankedView& view : plan_.views) {
    double sum = 0;
    for (const double score : view.score_by_kind) sum += score;
    EXPECT_NEAR(sum, view.score, 1e-9 * view.score);
  }
}

TEST_F(WholePlanTest, GainsByKindSumToTheModelGain) {
  for (const RankedView& view : plan_.views) {
    double sum = 0;
    for (const double gain : view.gain_by_kind) sum += gain;
    EXPECT_NEAR(sum, view.model_gain.value(), 1e-9 * sum);
    EXPECT_LE(view.expected_gain_lower.value(), view.expected_gain.value());
    EXPECT_LE(view.expected_gain.value(), view.expected_gain_upper.value());
  }
}

// Against the room itself: its floor's voxels have their middle at -0.025 m.
TEST_F(WholePlanTest, ViewsSayWhereTheyStand) {
  for (const RankedView& view : plan_.views) {
    EXPECT_NEAR(view.height_over_floor, view.position.z() + 0.025, 1e-6);
    EXPECT_GE(view.height_over_floor, config_.min_viewpoint_height);
    EXPECT_LE(view.height_over_floor, config_.max_viewpoint_height);
    double nearest = 10;
    for (int z = 0; z < 54; ++z) {
      for (int y = 0; y < 100; ++y) {
        for (int x = 0; x < 120; ++x) {
          if (model_.Empty({x, y, z})) continue;
          const Region voxel(0.05 * Eigen::Vector3d(x, y, z),
                             0.05 * Eigen::Vector3d(x + 1, y + 1, z + 1));
          nearest = std::min(nearest, voxel.exteriorDistance(view.position));
        }
      }
    }
    for (int axis = 0; axis < 3; ++axis) {  // to walls, floor and ceiling
      const double room = axis == 0 ? 6 : axis == 1 ? 5 : 2.7;
      nearest = std::min({nearest, view.position[axis], room - view.position[axis]});
    }
    EXPECT_GE(nearest, scanner_.clearance);
    EXPECT_NEAR(view.clearance, nearest, 1e-6);
    ASSERT_TRUE(view.travel.has_value());
    EXPECT_GE(*view.travel, (view.position - model_.stations()[0].position).head<2>().norm() - 0.2);
    EXPECT_THAT(view.location.description, HasSubstr("the last station"));
  }
}

TEST_F(WholePlanTest, ViewsSayWhatTheyGainAndAround) {
  for (const RankedView& view : plan_.views) {
    EXPECT_TRUE(view.region.box.contains(view.position));
    EXPECT_GE(view.region.viewcell_count, 1);
    ASSERT_FALSE(view.patch_scores.empty());
    double sum = 0;
    for (const PatchScore& patch : view.patch_scores) sum += patch.score;
    EXPECT_LE(sum, view.score * (1 + 1e-6));
    EXPECT_GT(sum, 0);
  }
}

// By what may still be gained, in m2 of the model, and by the patches that are left.
TEST_F(WholePlanTest, StopsWhereTheConfigurationSaysThatItIsEnough) {
  EXPECT_FALSE(plan_.termination.suggested) << plan_.termination.reason;
  // Some view brings so much at least, and none more than that.
  const double least = plan_.termination.best_gain_without_hidden.value();
  const double most = plan_.termination.best_gain_without_hidden_upper.value();
  const auto suggested = [&] {
    return Make(model_, parallel::Budget::Unlimited(), serial_).termination.suggested;
  };
  config_.terminate_below = 1.001 * most;
  EXPECT_TRUE(suggested());
  config_.terminate_below = 0.999 * least;
  EXPECT_FALSE(suggested());
  double largest = 0;
  for (const Patch& patch : plan_.patches) largest = std::max(largest, patch.area);
  config_.min_patch_area = 1.001 * largest;
  EXPECT_TRUE(suggested());
}

TEST_F(PlannerTest, EvaluateViewSaysWhatThePlanSays) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(2));
  const Plan plan = Make(model, parallel::Budget::Unlimited(), serial_);
  ASSERT_FALSE(plan.views.empty());
  const absl::StatusOr<ViewEvaluation> one =
      EvaluateView(model, scanner_, config_, plan.views[0].position, serial_);
  ASSERT_TRUE(one.ok());
  EXPECT_TRUE(one->feasible) << one->infeasible_message;
  EXPECT_EQ(one->view.score, plan.views[0].score);
  EXPECT_EQ(one->view.score_by_kind, plan.views[0].score_by_kind);
  EXPECT_EQ(one->view.verdict.error_bound, plan.views[0].verdict.error_bound);
  const absl::StatusOr<ViewEvaluation> high =
      EvaluateView(model, scanner_, config_, {1.5, 1.5, 2.5}, serial_);
  EXPECT_FALSE(high->feasible);
  EXPECT_THAT(high->infeasible_message, HasSubstr("max_viewpoint_height"));
  EXPECT_EQ(EvaluateView(model, scanner_, config_, {std::numeric_limits<double>::quiet_NaN(), 0, 0},
                         serial_)
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

void ExpectSame(const Plan& a, const Plan& b) {
  EXPECT_EQ(a.outcome, b.outcome);
  EXPECT_EQ(a.message, b.message);
  EXPECT_EQ(a.rays, b.rays);
  EXPECT_EQ(a.optimality_gap, b.optimality_gap);
  EXPECT_EQ(a.termination.reason, b.termination.reason);
  ASSERT_EQ(a.score_map.size(), b.score_map.size());
  for (size_t i = 0; i < a.score_map.size(); ++i) {
    ASSERT_EQ(a.score_map[i].centre, b.score_map[i].centre);
    ASSERT_EQ(a.score_map[i].score, b.score_map[i].score);
    ASSERT_EQ(a.score_map[i].upper, b.score_map[i].upper);
  }
  ASSERT_EQ(a.views.size(), b.views.size());
  for (size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].position, b.views[i].position);
    EXPECT_EQ(a.views[i].score, b.views[i].score);
    EXPECT_EQ(a.views[i].verdict.error_bound, b.views[i].verdict.error_bound);
    EXPECT_EQ(a.views[i].location.description, b.views[i].location.description);
  }
}

TEST_F(PlannerTest, SamePlanOnAnyNumberOfThreadsUnderAWorkLimit) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  for (const uint64_t limit : {300'000u, 3'000'000u}) {
    parallel::Budget budget;
    budget.work_limit = limit;
    const Plan one = Make(model, budget, serial_);
    EXPECT_LT(one.rays, limit + limit / 2);
    for (const int threads : {2, 16}) {
      parallel::ThreadPool pool(threads);
      ExpectSame(one, Make(model, budget, pool));
    }
  }
}

TEST_F(PlannerTest, CancelledSaysSo) {
  std::stop_source source;
  source.request_stop();
  parallel::Budget budget;
  budget.cancelled = source.get_token();
  const Plan plan = Make(test_support::BuildView(test_support::FurnishedRoom(3)), budget, serial_);
  EXPECT_EQ(plan.outcome, PlanOutcome::kCancelled);
  EXPECT_EQ(plan.rays, 0u);
}

TEST_F(PlannerTest, AnswersWithoutAnyTime) {
  const Plan plan = Make(test_support::BuildView(test_support::FurnishedRoom(3)),
                         parallel::Budget::Seconds(0), serial_);
  EXPECT_EQ(plan.outcome, PlanOutcome::kViews) << plan.message;
  ASSERT_FALSE(plan.views.empty());
  EXPECT_TRUE(plan.views[0].verdict.registered());
  EXPECT_FALSE(plan.complete);
  EXPECT_GT(plan.optimality_gap, 0);
  // What the place brings that people are sent to is said, too.
  EXPECT_GT(plan.views[0].model_gain.value_or(0), 0);
  EXPECT_GE(plan.views[0].expected_gain.value_or(0), plan.views[0].expected_gain_lower.value_or(1));
}

TEST_F(PlannerTest, FinishedSiteSuggestsToStop) {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(3);
  scene.known = [](const Eigen::Vector3d&) { return true; };
  scene.density = [](const Eigen::Vector3d&) { return 1e5; };
  const Plan plan = Make(test_support::BuildView(scene), parallel::Budget::Unlimited(), serial_);
  EXPECT_EQ(plan.outcome, PlanOutcome::kNothingToGain);
  EXPECT_TRUE(plan.termination.suggested);
  ASSERT_TRUE(plan.coverage.has_value());
  EXPECT_NEAR(plan.coverage->estimated_coverage.value_or(0), 1, 1e-9);
}

TEST_F(PlannerTest, NowhereToStandNamesTheConstraint) {
  scanner_.clearance = 4;
  const Plan plan = Make(test_support::BuildView(test_support::FurnishedRoom(3)),
                         parallel::Budget::Unlimited(), serial_);
  EXPECT_EQ(plan.outcome, PlanOutcome::kNoFeasibleView);
  EXPECT_THAT(plan.message, HasSubstr("clearance"));
  EXPECT_FALSE(plan.termination.suggested);
  EXPECT_GT(plan.deficient_cells, 0u);
}

TEST_F(PlannerTest, NothingRegistersComesWithRemedies) {
  config_.registration.minimum_overlap = 0.99;
  const Plan plan = Make(test_support::BuildView(test_support::FurnishedRoom(3)),
                         parallel::Budget::Unlimited(), serial_);
  EXPECT_EQ(plan.outcome, PlanOutcome::kNoRegistrableView);
  EXPECT_TRUE(plan.views.empty());
  EXPECT_FALSE(plan.termination.suggested);
  ASSERT_FALSE(plan.refused.empty());
  for (const RankedView& view : plan.refused) {
    EXPECT_LT(view.verdict.overlap_share, 0.99);
    EXPECT_THAT(view.verdict.reason, HasSubstr("overlaps what is scanned already, 99 %"));
    EXPECT_FALSE(view.verdict.remedy.empty());
    // Where the overlap alone is too small, that is what to do something about.
    if (registration::kBoundMargin * view.verdict.judged_bound >
        config_.registration.required_accuracy) {
      continue;
    }
    EXPECT_THAT(view.verdict.remedy, HasSubstr("nearer to what is scanned already"));
  }
  EXPECT_THAT(plan.message, HasSubstr("the first: " + plan.refused[0].verdict.reason));
  EXPECT_THAT(plan.message, HasSubstr("remedy: " + plan.refused[0].verdict.remedy));
}

// With an accuracy that some views meet and others don't, many of them by little.
TEST_F(PlannerTest, ReturnsWhatRegistersAndRefusesWhatDoesNot) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  config_.viewcell_size = 0.4;
  config_.candidates = 40;
  config_.registration.required_accuracy = 0.5;
  std::vector<double> bounds;
  for (const RankedView& view : Make(model, parallel::Budget::Unlimited(), serial_).views) {
    bounds.push_back(view.verdict.judged_bound);
  }
  ASSERT_GT(bounds.size(), 6u);
  std::sort(bounds.begin(), bounds.end());
  const double required = bounds[bounds.size() / 2];  // of what is predicted
  config_.registration.required_accuracy = registration::kBoundMargin * required;
  const Plan plan = Make(model, parallel::Budget::Unlimited(), serial_);
  ASSERT_FALSE(plan.views.empty());
  ASSERT_FALSE(plan.refused.empty());
  for (const RankedView& view : plan.views) {
    EXPECT_TRUE(view.verdict.registered());
    EXPECT_LE(view.verdict.judged_bound, required);
    EXPECT_TRUE(view.verdict.reason.empty()) << view.verdict.reason;
  }
  for (const RankedView& view : plan.refused) {
    EXPECT_FALSE(view.verdict.registered());
    EXPECT_GT(view.verdict.judged_bound, required);
    EXPECT_FALSE(view.verdict.reason.empty());
  }
}

TEST_F(PlannerTest, ImpossibleConfigurationNamesEveryField) {
  config_.required_density = 1e12;
  config_.viewcell_size = -1;
  config_.candidates = 0;
  config_.rejected = {{Eigen::Vector3d::Zero(), -1}};
  const auto status = MakePlan(test_support::BuildView(test_support::FurnishedRoom(3)), scanner_,
                               config_, {}, serial_, [](const Plan&) {})
                          .status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const std::string message(status.message().data(), status.message().size());
  EXPECT_THAT(message, HasSubstr("required_density"));
  EXPECT_THAT(message, HasSubstr("viewcell_size"));
  EXPECT_THAT(message, HasSubstr("candidates"));
  EXPECT_THAT(message, HasSubstr("rejected[0]"));
}

TEST_F(PlannerTest, ViewcellMustBeAMultipleOfTheVoxel) {
  config_.viewcell_size = 0.12;
  EXPECT_EQ(MakePlan(test_support::BuildView(test_support::FurnishedRoom(3)), scanner_, config_, {},
                     serial_, [](const Plan&) {})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(PlannerTest, CoverageAddsUp) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  const Coverage coverage = MeasureCoverage(model, std::span(&scanner_, 1), config_).value();
  double all = 0;
  for (const double area : coverage.area) all += area;
  EXPECT_GT(coverage.area[static_cast<size_t>(model::SurfaceKind::kTrue)], 50);
  EXPECT_GT(coverage.area[static_cast<size_t>(model::SurfaceKind::kOcclusion)], 1);
  EXPECT_NEAR(coverage.estimated_coverage.value_or(0),
              coverage.area_at_density / (all - coverage.area_out_of_reach), 1e-12);
}

// A sealed room beside the one with the station. It is known to be empty, but cannot be reached.
TEST_F(PlannerTest, SaysWhatNoFeasibleViewCanSee) {
  test_support::ClosedFormScene scene;
  const Region room(Eigen::Vector3d::Zero(), Eigen::Vector3d(4, 3, 2.6));
  const Region sealed(Eigen::Vector3d(4.2, 0, 0), Eigen::Vector3d(6.2, 3, 2.6));
  scene.extent = Region(Eigen::Vector3d(-0.1, -0.1, -0.1), Eigen::Vector3d(6.3, 3.1, 2.7));
  scene.solid = [=](const Eigen::Vector3d& p) { return !room.contains(p) && !sealed.contains(p); };
  // In the room a piece of one wall is missing, 0.5 m x 0.5 m.
  const Region missing(Eigen::Vector3d(-0.1, 1, 1), Eigen::Vector3d(0, 1.5, 1.5));
  scene.density = [=](const Eigen::Vector3d& p) {
    return missing.contains(p) || p.x() > 4.1 ? 0 : 1e5;
  };
  scene.stations = {test_support::MakeStation(Eigen::Vector3d(1.5, 1.5, 1.5))};
  const Plan plan = Make(test_support::BuildView(scene), parallel::Budget::Unlimited(), serial_);
  ASSERT_TRUE(plan.complete) << plan.message;
  ASSERT_TRUE(plan.termination.unobservable_known);
  const double surface = 2 * (2 * 3 + 2 * 2.6 + 3 * 2.6);
  EXPECT_NEAR(plan.termination.unobservable_area, surface, 0.03 * surface);
  EXPECT_NEAR(plan.deficient_area - plan.termination.unobservable_area, 0.25, 0.01);
}

TEST_F(PlannerTest, RegionIsTheConnectedCellsThatAreAsGood) {
  const Plan plan = Make(test_support::BuildView(test_support::FurnishedRoom(2)),
                         parallel::Budget::Unlimited(), serial_);
  ASSERT_TRUE(plan.complete);
  const double size = config_.viewcell_size;
  std::map<std::array<int, 3>, double> score;
  const auto key = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3i c = (p / size).array().floor().cast<int>();
    return std::array<int, 3>{c.x(), c.y(), c.z()};
  };
  for (const ScoredCell& cell : plan.score_map) {
    score[key(cell.centre.cast<double>())] = static_cast<double>(cell.score);
  }
  ASSERT_FALSE(plan.views.empty());
  bool several = false;
  for (const RankedView& view : plan.views) {
    // The map's scores are rounded to floats, which keeps their order.
    const double enough = static_cast<float>(0.95 * view.score);
    std::set<std::array<int, 3>> region;
    std::vector<std::array<int, 3>> open = {key(view.position)};
    while (!open.empty()) {
      const std::array<int, 3> cell = open.back();
      open.pop_back();
      const auto at = score.find(cell);
      if (at == score.end() || at->second < enough || !region.insert(cell).second) continue;
      for (size_t axis = 0; axis < 3; ++axis) {
        for (const int side : {-1, 1}) {
          open.push_back(cell);
          open.back()[axis] += side;
        }
      }
    }
    EXPECT_EQ(view.region.viewcell_count, static_cast<int>(region.size()));
    EXPECT_NEAR(view.region.volume, static_cast<double>(region.size()) * size * size * size, 1e-9);
    Region box;
    for (const auto& cell : region) {
      const Eigen::Vector3d low = Eigen::Vector3d(cell[0], cell[1], cell[2]) * size;
      box.extend(low);
      box.extend(Eigen::Vector3d(low.array() + size));
    }
    EXPECT_TRUE(view.region.box.isApprox(box, 1e-9));
    several |= region.size() > 3;
  }
  EXPECT_TRUE(several);
}

TEST_F(PlannerTest, ThePapersOrderEndsWithTheSameViews) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(4));
  const Plan anytime = Make(model, parallel::Budget::Unlimited(), serial_);
  config_.order = EvaluationOrder::kPatches;
  const Plan by_patches = Make(model, parallel::Budget::Unlimited(), serial_);
  EXPECT_TRUE(by_patches.complete);
  ASSERT_EQ(anytime.views.size(), by_patches.views.size());
  ASSERT_FALSE(anytime.views.empty());
  EXPECT_EQ(anytime.views[0].position, by_patches.views[0].position);
  for (size_t i = 0; i < anytime.views.size(); ++i) {
    EXPECT_NEAR(anytime.views[i].score, by_patches.views[i].score, 1e-6 * anytime.views[i].score);
  }
}

TEST_F(PlannerTest, RefusesWhatTakesMoreMemoryThanAllowed) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  const auto problem = PlanningProblem::Prepare({model, scanner_, config_}, serial_).value();
  const uint64_t needed =
      PlanningSize(model, config_).Bytes(static_cast<double>(problem->feasible().cells().size()));
  EXPECT_LE(needed, EstimatePlanningMemory(model, config_));
  config_.memory_limit = needed;
  EXPECT_EQ(Make(model, parallel::Budget::Unlimited(), serial_).outcome, PlanOutcome::kViews);
  config_.memory_limit = needed - 1;
  const absl::Status status =
      MakePlan(model, scanner_, config_, parallel::Budget::Unlimited(), serial_, [](const Plan&) {
      }).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("memory_limit"));
}

// What a plan takes is a matter of surface and floor, not of the space between them.
TEST_F(PlannerTest, FarApartCostsNoMore) {
  const model::PlanningView room = test_support::BuildView(test_support::FurnishedRoom(3));
  std::vector<model::BrickAt> bricks(room.bricks().begin(), room.bricks().end());
  const auto empty = std::find_if(bricks.begin(), bricks.end(), [](const model::BrickAt& at) {
    return at.contents->surface.empty();
  });
  ASSERT_TRUE(empty != bricks.end());
  config_.unknown_depth = 0;  // which the box limits
  // 300 m up: a box of tens of millions of viewcells.
  bricks.push_back({model::VoxelIndex(empty->brick.x(), empty->brick.y(), 750), empty->contents});
  const model::PlanningView tall(room.voxel_size(), 1, bricks, room.stations());
  EXPECT_LT(EstimatePlanningMemory(tall, config_), 1.05 * EstimatePlanningMemory(room, config_));
  parallel::Budget budget;
  budget.work_limit = 200'000;
  const Plan expected = Make(room, budget, serial_);
  const Plan plan = Make(tall, budget, serial_);
  EXPECT_EQ(plan.feasible_cells, expected.feasible_cells);
  ASSERT_FALSE(plan.views.empty());
  EXPECT_EQ(plan.views[0].position, expected.views[0].position);
  EXPECT_EQ(plan.views[0].score, expected.views[0].score);
}

// Columns of floors go with the model's box. Where that is too wide for the memory that there is,
// coverage is refused, before any is taken.
TEST_F(PlannerTest, CoverageOfABoxThatIsTooWideIsRefused) {
  const model::PlanningView room = test_support::BuildView(test_support::FurnishedRoom(3));
  const auto site = MeasureSite(room, std::span(&scanner_, 1), config_);
  ASSERT_TRUE(site.ok()) << site.status();
  EXPECT_EQ(site->storeys.size(), 1u);
  const auto coverage = MeasureCoverage(room, std::span(&scanner_, 1), config_);
  ASSERT_TRUE(coverage.ok()) << coverage.status();
  EXPECT_EQ(site->coverage.area_at_density, coverage->area_at_density);
  std::vector<model::BrickAt> bricks(room.bricks().begin(), room.bricks().end());
  const auto empty = std::find_if(bricks.begin(), bricks.end(), [](const model::BrickAt& at) {
    return at.contents->surface.empty();
  });
  ASSERT_TRUE(empty != bricks.end());
  // A brick 40 km away both ways: more than 10^12 columns.
  bricks.push_back({empty->brick + model::VoxelIndex(200'000, 200'000, 0), empty->contents});
  const model::PlanningView wide(room.voxel_size(), 1, bricks, room.stations());
  const auto refused = MeasureSite(wide, std::span(&scanner_, 1), config_);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("memory_limit"));
}

}  // namespace
}  // namespace vantage::planning
