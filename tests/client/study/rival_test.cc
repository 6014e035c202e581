// Single choices of rivals, in a small model.
#include "client/study/rival.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "client/simulated_job/placement.h"
#include "client/study/scene_list.h"
#include "client/study/surveyor_rival.h"
#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluate_view.h"
#include "core/registration/levelling.h"

namespace vantage::study {
namespace {

StudySettings Coarse() {
  StudySettings settings;
  settings.scanner.azimuth_step = settings.scanner.elevation_step = sensor::Radians(1);
  settings.required_density = 150;
  settings.truth_samples = 3000;
  settings.most_scans = 6;
  return settings;
}

// The two rooms after their first scan.
class RivalChoiceTest : public ::testing::Test {
 protected:
  RivalChoiceTest()
      : scene_(StudyScene::Make(BuildScene("two-rooms-1", "").value(), Coarse(), serial_).value()),
        model_(model::PartialModel::Create({}).value()) {
    const simulated_job::Placement first =
        simulated_job::FirstPlacement(scene_->StartFor(1), scene_->ErrorsFor(1));
    sensor::Scan scan;
    scan.scanner = scene_->settings().scanner;
    scan.image = scene_->scanner().Scan(scan.scanner, first.T_scene_scan,
                                        simulation::ScanFaults::None(), 1, serial_);
    const Eigen::Isometry3d T_world_scan = registration::LevelFirstScan(scan).value().T_world_scan;
    EXPECT_TRUE(model_->Insert("first", scan, T_world_scan, serial_).ok());
    view_ = model_->Publish();
    stations_.push_back(T_world_scan.translation());
    T_scene_world_ = first.T_scene_scan * T_world_scan.inverse();
    config_.required_density = 150;
    config_.station_basis = planning::StationBasis::kExpected;
  }

  std::shared_ptr<const planning::PlanningProblem> Problem() {
    return planning::PlanningProblem::Prepare({*view_, scene_->settings().scanner, config_},
                                              serial_)
        .value();
  }
  Proposal Ask(Rival& rival, const planning::PlanningProblem& problem) {
    return rival.Propose({problem, stations_, 2, 1, T_scene_world_, serial_});
  }

  parallel::Serial serial_;
  std::unique_ptr<StudyScene> scene_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  std::vector<Eigen::Vector3d> stations_;
  Eigen::Isometry3d T_scene_world_ = Eigen::Isometry3d::Identity();
  planning::PlanningConfig config_;
};

// The more a scan gains the less it overlaps: with this much to overlap the best would be lost.
TEST_F(RivalChoiceTest, WhoKnowsTrueGainsTakesWhatRegisters) {
  const auto usual = Problem();
  for (const planning::StationBasis basis :
       {planning::StationBasis::kKnown, planning::StationBasis::kExpected}) {
    const auto rival = FeasibleOracleRival(*scene_, basis);
    const Proposal best = Ask(*rival, *usual);
    ASSERT_TRUE(best.position.has_value()) << best.why;
    const auto as_usual = planning::EvaluateView(*usual, *best.position);
    ASSERT_TRUE(as_usual.ok()) << as_usual.status();
    EXPECT_TRUE(as_usual->view.verdict.registered());

    config_.registration.minimum_overlap = 1.01 * as_usual->view.verdict.overlap_share;
    const auto strict = Problem();
    const auto careful = FeasibleOracleRival(*scene_, basis);
    const Proposal other = Ask(*careful, *strict);
    ASSERT_TRUE(other.position.has_value()) << other.why;
    EXPECT_NE(*other.position, *best.position);
    EXPECT_LE(*other.predicted, *best.predicted);
    const auto evaluated = planning::EvaluateView(*strict, *other.position);
    ASSERT_TRUE(evaluated.ok()) << evaluated.status();
    EXPECT_TRUE(evaluated->view.verdict.registered()) << evaluated->view.verdict.reason;
    config_.registration.minimum_overlap = 0.1;
  }
}

TEST_F(RivalChoiceTest, WhereNothingRegistersTheNearestToAStationIsTaken) {
  config_.registration.minimum_overlap = 0.999;
  const auto problem = Problem();
  const auto rival = FeasibleOracleRival(*scene_, planning::StationBasis::kKnown);
  const Proposal proposal = Ask(*rival, *problem);
  ASSERT_TRUE(proposal.position.has_value()) << proposal.why;
  EXPECT_LT((*proposal.position - stations_[0]).norm(), 0.6);
}

TEST_F(RivalChoiceTest, ASurveyorStandsWhereOneMayAndSaysWhatIsNotKnown) {
  const auto problem = Problem();
  const auto rival = SurveyorRival();
  const Proposal proposal = Ask(*rival, *problem);
  ASSERT_TRUE(proposal.position.has_value()) << proposal.why;
  const planning::FeasibleViews& feasible = problem->feasible();
  EXPECT_GE(feasible.IndexOf(feasible.CellOf(*proposal.position)), 0);
  EXPECT_EQ(proposal.expected.has_value(),
            problem->BasisOf(*proposal.position) == planning::StationBasis::kExpected);
  EXPECT_FALSE(proposal.predicted.has_value());
}

// A floor of spots, 10 cm apart, over [0, width) x [0, depth), m.
std::vector<Spot> FloorOfSpots(int width, int depth, double floor = 0) {
  std::vector<Spot> spots;
  for (int y = 0; y < depth; ++y) {
    for (int x = 0; x < width; ++x) {
      spots.push_back({{0.1 * x + 0.05, 0.1 * y + 0.05, floor + 1.5}, {x, y}, floor});
    }
  }
  return spots;
}

planning::Opening DoorwayAt(const Eigen::Vector3d& centre) {
  planning::Opening doorway;
  doorway.centre = centre;
  doorway.width = 0.9;
  doorway.floor_through = doorway.lintel = true;
  return doorway;
}

TEST(RoomsOfSpotsTest, DoorwaysDivideThemAndFloorsDo) {
  // 3 m long and 0.9 m wide, with a doorway in its middle.
  std::vector<Spot> spots = FloorOfSpots(30, 9);
  EXPECT_EQ(RoomsOf(spots, 0.1, {}).size(), 1u);
  const auto two = RoomsOf(spots, 0.1, {DoorwayAt({1.5, 0.45, 0})});
  ASSERT_EQ(two.size(), 2u);
  for (const std::vector<size_t>& room : two) {
    EXPECT_EQ(room.size(), 12u * 9u) << "0.3 m on either side belong to the doorway";
  }
  EXPECT_EQ(RoomsOf(spots, 0.1, {DoorwayAt({1.5, 0.45, 3})}).size(), 1u) << "of another storey";

  // A storey over it is another room; what is smaller than a quarter of a square metre is none.
  const std::vector<Spot> upstairs = FloorOfSpots(10, 9, 3);
  spots.insert(spots.end(), upstairs.begin(), upstairs.end());
  EXPECT_EQ(RoomsOf(spots, 0.1, {}).size(), 2u);
  EXPECT_TRUE(RoomsOf(FloorOfSpots(4, 4), 0.1, {}).empty());
}

}  // namespace
}  // namespace vantage::study
