// What is expected beyond a model: in a scene with two rooms of which one was scanned, against the
// model and the mesh.
#include "core/planning/expectation/expectation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/openings/openings.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/view_report.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

bool Measured(model::VoxelState state) {
  return state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
}

class ExpectationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4);
    model_ = model::PartialModel::Create({}).value();
    ScanFrom(0);
  }
  void ScanFrom(size_t start) { ScanAt(scene_.starts[start], 1 + start, {}); }
  // Behind `pane` nothing returns anything.
  void ScanAt(const Eigen::Vector3d& place, uint64_t seed, const std::optional<Opening>& pane) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(place);
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer_.Scan(scanner_, pose, simulation::ScanFaults{}, seed, pool_);
    for (int column = 0; pane.has_value() && column < scan.image.columns(); ++column) {
      for (int row = 0; row < scan.image.rows(); ++row) {
        float& range = scan.image.range[scan.image.Index(column, row)];
        const double level = std::cos(scan.image.elevation[static_cast<size_t>(row)]);
        const double azimuth = scan.image.azimuth[static_cast<size_t>(column)];
        const Eigen::Vector3d ray(level * std::cos(azimuth), level * std::sin(azimuth), 0);
        const Eigen::Vector3d at = place + static_cast<double>(range) * ray;
        const double beyond = (at - pane->centre).head<2>().dot(pane->direction.head<2>());
        if (beyond > 0.7) range = sensor::RangeImage::kNoReturn;
      }
    }
    ASSERT_TRUE(model_->Insert("scan" + std::to_string(seed), scan, pose, pool_).ok());
    view_ = model_->Publish();
    config_.station_basis = StationBasis::kExpected;
    problem_ = PlanningProblem::Prepare({*view_, scanner_, config_}, pool_).value();
  }
  const Expectation& expected() const { return *problem_->expectation(); }
  int MeasuredAround(const model::VoxelIndex& v) const {
    int around = 0;
    for (int z = v.z() - 1; z <= v.z() + 1; ++z) {
      for (int y = v.y() - 1; y <= v.y() + 1; ++y) {
        for (int x = v.x() - 1; x <= v.x() + 1; ++x) {
          around += Measured(expected().view().State({x, y, z})) ? 1 : 0;
        }
      }
    }
    return around - 1;
  }
  template <typename Fn>
  void ForEachVoxel(Fn&& fn) const {
    const model::VoxelBox& box = expected().view().bounds();
    for (int z = box.min.z(); z < box.max.z(); ++z) {
      for (int y = box.min.y(); y < box.max.y(); ++y) {
        for (int x = box.min.x(); x < box.max.x(); ++x) fn(model::VoxelIndex(x, y, z));
      }
    }
  }

  const simulation::Scene scene_ = simulation::TwoRooms(1);
  const simulation::SimulatedScanner tracer_{scene_.mesh};
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  std::shared_ptr<const PlanningProblem> problem_;
};

TEST_F(ExpectationTest, WhatIsKnownStaysAsItIs) {
  size_t known = 0;
  size_t expected_free = 0;
  size_t floating = 0;
  ForEachVoxel([&](const model::VoxelIndex& v) {
    const model::VoxelState state = view_->State(v);
    const bool is_known = Measured(state) || state == model::VoxelState::kEmpty;
    if (is_known) {
      ++known;
      ASSERT_EQ(expected().view().State(v), state) << v.transpose();
      ASSERT_FALSE(expected().Expected(v));
    } else if (expected().view().Empty(v)) {
      ++expected_free;
      ASSERT_TRUE(expected().Expected(v));
    }
    // What somebody finds in the way is what was measured, and does not float by itself.
    if (Measured(expected().view().State(v)) && MeasuredAround(v) < 2) {
      ++floating;
      ASSERT_TRUE(expected().standing().Empty(v)) << v.transpose();
    } else {
      ASSERT_EQ(Measured(expected().view().State(v)), !expected().standing().Empty(v));
    }
  });
  EXPECT_GT(floating, 0u) << "mixed pixels at edges: the few that no rule tells from a wire";
  EXPECT_GT(known, 100'000u);
  EXPECT_GT(expected_free, 1000u);
}

// All around known free space there is surface, known or expected: rays end somewhere.
TEST_F(ExpectationTest, ExpectedSpaceIsClosed) {
  ForEachVoxel([&](const model::VoxelIndex& v) {
    if (!expected().view().Empty(v) || !expected().Expected(v)) return;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        model::VoxelIndex to = v;
        to[axis] += sign;
        ASSERT_NE(expected().view().State(to), model::VoxelState::kUnknown)
            << v.transpose() << " to " << to.transpose();
      }
    }
  });
}

TEST_F(ExpectationTest, PlacesInTheOtherRoomAreExpectedAndNoKnownOneIsLost) {
  PlanningConfig known_config = config_;
  known_config.station_basis = StationBasis::kKnown;
  const auto known = PlanningProblem::Prepare({*view_, scanner_, known_config}, pool_).value();
  EXPECT_EQ(known->expectation(), nullptr);
  for (const auto& cell : known->feasible().cells()) {
    ASSERT_GE(problem_->feasible().IndexOf(cell), 0) << cell.transpose();
  }
  size_t behind = 0;
  for (size_t i = 0; i < problem_->feasible().cells().size(); ++i) {
    const Eigen::Vector3d place = problem_->feasible().Centre(i);
    const bool is_known = known->feasible().IndexOf(problem_->feasible().cells()[i]) >= 0;
    ASSERT_EQ(problem_->BasisOf(place) == StationBasis::kKnown, is_known) << place.transpose();
    ASSERT_EQ(known->BasisOf(place), StationBasis::kKnown);
    if (!is_known && expected().Behind(place).has_value()) ++behind;
  }
  EXPECT_GT(behind, 100u);
}

TEST_F(ExpectationTest, AReportSaysWhatIsAssumedAndCountsItApart) {
  const ViewReport report(*problem_);
  parallel::Serial serial;
  RankedView inside;
  for (size_t i = 0; i < problem_->feasible().cells().size(); ++i) {
    const Eigen::Vector3d place = problem_->feasible().Centre(i);
    if (problem_->BasisOf(place) == StationBasis::kKnown || !expected().Behind(place)) continue;
    report.Place(place, inside);
    ASSERT_TRUE(report.Exact(place, parallel::Budget::Unlimited(), serial, inside));
    break;
  }
  ASSERT_TRUE(inside.expected.has_value());
  ASSERT_TRUE(inside.expected->doorway.has_value());
  EXPECT_LT((inside.expected->doorway->head<2>() - scene_.doorways[0].middle).norm(), 0.4);
  EXPECT_FALSE(inside.floor_measured);
  EXPECT_GT(inside.expected_gain.value(), inside.model_gain.value() + 1);
  RankedView at_start;
  report.Place(view_->stations()[0].position, at_start);
  EXPECT_FALSE(at_start.expected.has_value());
}

// What is expected opens the job again, and is not called known.
TEST_F(ExpectationTest, AJobEndsByExpectedGainAndModelGainIsSaidApart) {
  parallel::Budget budget;
  budget.work_limit = 5'000'000;
  const Plan plan = MakePlan(*problem_, budget, pool_, [](const Plan&) {});
  ASSERT_FALSE(plan.views.empty());
  double model_gain = 0;
  double gain = 0;
  for (const auto* views : {&plan.views, &plan.refused}) {
    for (const RankedView& view : *views) {
      model_gain = std::max(model_gain, view.model_gain.value_or(0));
      gain = std::max(gain, view.gain_without_hidden.value_or(0));
      EXPECT_GE(view.expected_gain.value_or(0), view.gain_without_hidden.value_or(0));
    }
  }
  ASSERT_GT(gain, model_gain + 1);
  EXPECT_EQ(plan.termination.best_model_gain.value(), model_gain);
  EXPECT_GE(plan.termination.best_gain_without_hidden.value(), gain);
  EXPECT_GE(plan.termination.best_gain_without_hidden_upper.value(),
            plan.termination.best_gain_without_hidden.value());
}

// Who finds no free spot takes the best view that stands on what is known.
TEST_F(ExpectationTest, ExpectedViewsNameTheKnownOneToTakeInstead) {
  config_.candidates = 30;
  config_.candidate_separation = 0.6;
  problem_ = PlanningProblem::Prepare({*view_, scanner_, config_}, pool_).value();
  parallel::Budget budget;
  budget.work_limit = 5'000'000;
  const Plan plan = MakePlan(*problem_, budget, pool_, [](const Plan&) {});
  const auto known = std::find_if(plan.views.begin(), plan.views.end(),
                                  [](const RankedView& v) { return !v.expected.has_value(); });
  ASSERT_NE(known, plan.views.end());
  size_t expected_views = 0;
  for (const RankedView& view : plan.views) {
    if (!view.expected.has_value()) continue;
    ++expected_views;
    EXPECT_EQ(view.expected->fallback, static_cast<size_t>(known - plan.views.begin()));
  }
  EXPECT_GT(expected_views, 0u);
}

// Once the room was entered, nothing of it is expected any more.
TEST_F(ExpectationTest, EndsWhereARoomWasEntered) {
  ScanFrom(1);
  for (const Eigen::Vector3d& start : scene_.starts) {
    EXPECT_FALSE(expected().Behind(start).has_value());
  }
}

// One place may have been taken by a cupboard. Where two were tried in vain nobody is sent again.
TEST_F(ExpectationTest, ARoomInWhichPlacesWereRejectedTwiceIsNotExpectedAnyMore) {
  const Eigen::Vector3d middle = scene_.starts[1];
  const RejectedPlace one{middle, 0.1};
  const RejectedPlace another{middle + Eigen::Vector3d(0.4, 0.3, 0), 0.1};
  const RejectedPlace here{scene_.starts[0], 0.1};
  ASSERT_TRUE(expected().Behind(one.position).has_value());
  ASSERT_TRUE(expected().Behind(another.position).has_value());
  const auto expects = [&](std::vector<RejectedPlace> rejected) {
    PlanningConfig config = config_;
    config.rejected = std::move(rejected);
    const auto problem = PlanningProblem::Prepare({*view_, scanner_, config}, pool_).value();
    const bool is_expected = problem->expectation()->Behind(middle).has_value();
    EXPECT_EQ(is_expected, !problem->expectation()->floors().empty());
    return is_expected;
  };
  EXPECT_TRUE(expects({one}));
  EXPECT_TRUE(expects({one, here})) << "only one of them lies in the room";
  EXPECT_FALSE(expects({one, another}));
}

// Who has scanned through a doorway and still knows nothing of what is behind it stood before
// glass.
TEST_F(ExpectationTest, ARoomThatWasLookedIntoInVainIsNotExpectedAnyMore) {
  const Eigen::Vector3d behind = scene_.starts[1];
  const std::optional<size_t> doorway = expected().Behind(behind);
  ASSERT_TRUE(doorway.has_value());
  const Opening opening = problem_->openings().openings[*doorway];
  Eigen::Vector3d before = opening.centre - 0.15 * opening.direction;
  before.z() = scene_.starts[0].z();

  ScanAt(before, 7, {});
  const size_t open = expected().floors().size();
  EXPECT_GT(open, 0u) << "an open door is looked through, and the room goes on beside what is seen";

  model_ = model::PartialModel::Create({}).value();
  ScanAt(before, 7, opening);
  const Openings& found = problem_->openings();
  EXPECT_TRUE(std::any_of(found.openings.begin(), found.openings.end(), [&](const Opening& other) {
    return other.doorway() && found.LeadsToUnknown(other) &&
           (other.centre - opening.centre).head<2>().norm() < 0.5;
  })) << "else there is nothing to expect";
  EXPECT_FALSE(expected().Behind(behind).has_value());
  EXPECT_EQ(expected().floors().size(), 0u);
}

TEST_F(ExpectationTest, IsTheSameFromAPreviousProblem) {
  const auto again =
      PlanningProblem::Prepare({*view_, scanner_, config_, problem_.get()}, pool_).value();
  EXPECT_EQ(again->expectation(), problem_->expectation());
  EXPECT_EQ(again->feasible().cells(), problem_->feasible().cells());
  EXPECT_EQ(again->patches().cells.size(), problem_->patches().cells.size());
  // Of another basis it shares none.
  PlanningConfig known = config_;
  known.station_basis = StationBasis::kKnown;
  const auto other =
      PlanningProblem::Prepare({*view_, scanner_, known, problem_.get()}, pool_).value();
  const auto scratch = PlanningProblem::Prepare({*view_, scanner_, known}, pool_).value();
  EXPECT_EQ(other->expectation(), nullptr);
  EXPECT_EQ(other->feasible().cells(), scratch->feasible().cells());
  EXPECT_EQ(other->patches().cells.size(), scratch->patches().cells.size());
}

}  // namespace
}  // namespace vantage::planning
