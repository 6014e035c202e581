// Jobs of a study in a coarse two-room scene, everything but the service.
#include "client/study/study_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "client/library/geometry.h"
#include "client/study/known_scene.h"
#include "client/study/scene_list.h"
#include "client/study/study.h"
#include "client/study/table.h"
#include "core/parallel/thread_pool.h"

namespace vantage::study {
namespace {

// Coarse and quick: 1 degree, and a density to match.
std::unique_ptr<StudyScene> TwoRoomsCoarse(double positioning_error, int most_scans = 4,
                                           double goal = 0.95) {
  StudySettings settings;
  settings.goal = goal;
  settings.scanner.azimuth_step = settings.scanner.elevation_step = sensor::Radians(1);
  settings.scanner.positioning_error = positioning_error;
  settings.required_density = 150;
  settings.truth_samples = 3000;
  settings.most_scans = most_scans;
  parallel::Serial serial;
  return StudyScene::Make(BuildScene("two-rooms-1", "").value(), settings, serial).value();
}

TEST(StudySceneTest, SetsSayWhatGainSays) {
  const auto scene = TwoRoomsCoarse(0.05);
  parallel::Serial serial;
  const std::vector<double> gains = scene->truth().GainAtDensity(scene->positions(), serial);
  for (size_t i = 0; i < gains.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(CountOf(scene->sets()[i])) * scene->area_per_sample(), gains[i],
                1e-9);
  }
  EXPECT_NEAR(static_cast<double>(CountOf(scene->attainable())) * scene->area_per_sample(),
              scene->truth().Measure().attainable_at_density_area, 1e-9);
}

TEST(StudySceneTest, StartsDifferBySeedAndAreAllowed) {
  const auto scene = TwoRoomsCoarse(0.05);
  std::vector<size_t> starts;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    starts.push_back(scene->StartIndex(seed));
    EXPECT_LT(starts.back(), scene->positions().size());
    EXPECT_EQ(starts.back(), scene->StartIndex(seed));
  }
  std::sort(starts.begin(), starts.end());
  EXPECT_GE(std::unique(starts.begin(), starts.end()) - starts.begin(), 5);
}

TEST(StudySceneTest, WaysLeadAroundWalls) {
  const auto scene = TwoRoomsCoarse(0.05);
  const std::vector<Eigen::Vector3d>& places = scene->positions();
  const std::vector<double> ways = scene->walks().Distances(places.front(), places);
  bool around = false;
  for (size_t i = 0; i < places.size(); ++i) {
    const double straight = (places[i] - places.front()).head<2>().norm();
    EXPECT_GE(ways[i], straight - 1e-9);
    EXPECT_LE(ways[i], 4 * straight + 4);
    around |= ways[i] > 1.3 * straight + 0.3;
    EXPECT_NEAR(scene->walks().Distance(places[i], places.front()), ways[i], 0.11);
  }
  EXPECT_TRUE(around) << "a wall stands between the rooms";
}

TEST(JobDiaryTest, APlaceThatHasNoFreeSpotCostsHalfAMinute) {
  const auto scene = TwoRoomsCoarse(0);
  parallel::Serial serial;
  const auto minutes = [&](const std::vector<simulated_job::TriedPlace>& tried) {
    JobDiary diary(*scene, "ours", 1, serial);
    ScanMade scan;
    scan.position = scan.at = scene->positions().front();
    scan.expected_places = tried;
    diary.Add(scan);
    return diary.record().scans(0).minutes();
  };
  const double at_once = minutes({});
  EXPECT_DOUBLE_EQ(minutes({{0.9, true}}), at_once);
  EXPECT_DOUBLE_EQ(minutes({{0.9, false}, {0.9, false}, {0.9, true}}), at_once + 1);
}

TEST(KnownSceneTest, OracleTakesTheBestWhenItHitsItsPositions) {
  const auto scene = TwoRoomsCoarse(0);
  parallel::Serial serial;
  JobDiary diary(*scene, "oracle", 1, serial);
  RunOracleJob(*scene, 1, diary);
  const study_records::v1::JobRecord& record = diary.record();
  ASSERT_GE(record.scans_size(), 2);
  for (int i = 1; i < record.scans_size(); ++i) {
    EXPECT_NEAR(record.scans(i).gained(), record.scans(i).best(), 1e-9);
    if (i > 1) {
      EXPECT_LE(record.scans(i).best(), record.scans(i - 1).best());
    }
  }
  EXPECT_TRUE(diary.Over());
}

TEST(KnownSceneTest, BestSpacingIsNotBeatenByAnyOfItsSpacings) {
  const auto scene = TwoRoomsCoarse(0);
  parallel::Serial serial;
  const RegularSpacing best = BestSpacing(*scene, 2);
  ASSERT_FALSE(best.route.empty());
  for (const Eigen::Vector3d& place : best.route) {
    EXPECT_THAT(scene->positions(), ::testing::Contains(place));
  }
  JobDiary diary(*scene, "spacing", 2, serial);
  RunGivenJob(*scene, 2, best.route, diary);
  JobDiary oracle(*scene, "oracle", 2, serial);
  RunOracleJob(*scene, 2, oracle);
  EXPECT_GT(diary.covered(), 0.5 * oracle.covered());
}

// Share of the attainable that a route covers with all scans allowed.
double CoveredInTheEnd(const StudyScene& scene, uint64_t seed,
                       const std::vector<Eigen::Vector3d>& route) {
  simulation::SampleSet covered = scene.sets()[scene.StartIndex(seed)];
  for (size_t i = 0; i < route.size() && i + 1 < static_cast<size_t>(scene.most_scans()); ++i) {
    const auto at = std::find(scene.positions().begin(), scene.positions().end(), route[i]);
    AddTo(covered, scene.sets()[static_cast<size_t>(at - scene.positions().begin())]);
  }
  return static_cast<double>(CountOf(covered)) / static_cast<double>(CountOf(scene.attainable()));
}

TEST(KnownSceneTest, SpacingThatFallsShortOfTheGoalCoversTheMostInTheEnd) {
  constexpr int kScans = 12;
  const auto out_of_reach = TwoRoomsCoarse(0, kScans, 2);
  const double best = CoveredInTheEnd(*out_of_reach, 1, BestSpacing(*out_of_reach, 1).route);
  for (const double goal : {0.6, 0.7, 0.8, 0.9, 0.95}) {
    const auto scene = TwoRoomsCoarse(0, kScans, goal);
    EXPECT_GE(best, CoveredInTheEnd(*scene, 1, BestSpacing(*scene, 1).route)) << goal;
  }
}

class RivalTest : public ::testing::TestWithParam<const char*> {};

TEST_P(RivalTest, RunsAJobThatRepeatsItself) {
  const auto scene = TwoRoomsCoarse(0.05, 2);
  const StudyPlanner* planner = FindPlanner(GetParam());
  ASSERT_NE(planner, nullptr);
  parallel::Serial serial;
  parallel::ThreadPool pool(2);
  auto record = RunStudyJob(*scene, *planner, 7, "", serial);
  ASSERT_TRUE(record.ok()) << record.status();
  auto again = RunStudyJob(*scene, *planner, 7, "", pool);
  ASSERT_TRUE(again.ok()) << again.status();
  ASSERT_GE(record->scans_size(), 2);
  ASSERT_EQ(record->scans_size(), again->scans_size());
  double covered = 0;
  for (int i = 0; i < record->scans_size(); ++i) {
    const study_records::v1::ScanRecord& scan = record->scans(i);
    EXPECT_EQ(scan.number(), i + 1);
    EXPECT_GE(scan.covered(), covered);
    EXPECT_LE(scan.covered(), 1);
    covered = scan.covered();
    EXPECT_EQ(scan.position().SerializeAsString(), again->scans(i).position().SerializeAsString());
    EXPECT_EQ(scan.covered(), again->scans(i).covered());
    EXPECT_EQ(scan.minutes(), again->scans(i).minutes());
    // Where it was meant to be is where a tripod fits.
    EXPECT_GE(scene->scanner().Clearance(client::FromProto(scan.position()), 0.3), 0.1);
  }
  EXPECT_EQ(client::FromProto(record->scans(0).position()), scene->StartFor(7));
}

INSTANTIATE_TEST_SUITE_P(Rivals, RivalTest,
                         ::testing::Values("random", "frontier", "octomap", "spacing", "oracle",
                                           "oracle-feasible", "oracle-expected", "surveyor"));

// Room by room and through the door between them, though it computes no gain.
TEST(SurveyorRivalTest, ScansEachRoomTwiceAndTheDoorwayOnce) {
  const auto scene = TwoRoomsCoarse(0.02, 5, 2);
  parallel::Serial serial;
  const auto record = RunStudyJob(*scene, *FindPlanner("surveyor"), 3, "", serial);
  ASSERT_TRUE(record.ok()) << record.status();
  ASSERT_EQ(record->scans_size(), 5) << record->ended();
  std::vector<int> in_room(scene->site().rooms.size(), 0);
  int in_doorway = 0;
  for (const study_records::v1::ScanRecord& scan : record->scans()) {
    EXPECT_TRUE(scan.merged());
    const Eigen::Vector2d at = client::FromProto(scan.position()).head<2>();
    ASSERT_EQ(scene->site().doorways.size(), 1u);
    if ((at - scene->site().doorways[0].middle).norm() < 0.75) {
      ++in_doorway;
      continue;
    }
    for (size_t i = 0; i < in_room.size(); ++i) {
      in_room[i] += scene->site().rooms[i].inside.contains(at) ? 1 : 0;
    }
  }
  EXPECT_EQ(in_doorway, 1);
  EXPECT_THAT(in_room, ::testing::ElementsAre(2, 2));
  ASSERT_EQ(record->rooms_size(), 2);
  for (const study_records::v1::RoomRecord& room : record->rooms()) {
    EXPECT_TRUE(room.has_entered()) << room.name();
  }
}

TEST(StudyPlannersTest, NamesAreDistinctAndDefaultsExist) {
  std::vector<std::string> names;
  for (const StudyPlanner& planner : AllPlanners()) names.push_back(planner.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
  for (const bool small : {false, true}) {
    EXPECT_FALSE(DefaultPlanners(small).empty());
    for (const std::string& name : DefaultPlanners(small)) EXPECT_NE(FindPlanner(name), nullptr);
  }
}

TEST(StudyScenesTest, TuningAndReportingShareNone) {
  const std::vector<std::string> tuning = DefaultScenes(SceneUse::kTuning, false);
  const std::vector<std::string> reporting = DefaultScenes(SceneUse::kReporting, false);
  ASSERT_FALSE(tuning.empty());
  ASSERT_FALSE(reporting.empty());
  for (const std::string& name : tuning) {
    EXPECT_EQ(UseOf(name), SceneUse::kTuning);
    EXPECT_THAT(reporting, ::testing::Not(::testing::Contains(name)));
  }
  for (const std::string& name : reporting) EXPECT_EQ(UseOf(name), SceneUse::kReporting);
  EXPECT_EQ(DefaultScenes(SceneUse::kReporting, true).size(), 3u);
  // Defaults were chosen by what these showed.
  for (const char* name : {"flat-1", "office-2", "hall-101", "flat-101", "small-house"}) {
    EXPECT_EQ(UseOf(name), SceneUse::kTuning) << name;
  }
}

TEST(StudyScenesTest, WhatIsNotThereIsNotFound) {
  EXPECT_EQ(BuildScene("flat", "").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(BuildScene("small-house", "/nowhere").status().code(), absl::StatusCode::kNotFound);
}

TEST(StudyScenesTest, AMissingMeshIsToldBeforeAnyJob) {
  const std::string folder = ::testing::TempDir() + "/vantage_missing_mesh";
  const JobStore store = JobStore::Open(folder).value();
  StudyPlan plan;
  plan.scenes = {"two-rooms-1", "small-house"};
  plan.planners = {"oracle"};
  plan.data_folder = "/nowhere";
  bool began = false;
  const auto outcome = RunStudy(plan, store, [&](const StudyProgress&) { began = true; });
  EXPECT_EQ(outcome.status().code(), absl::StatusCode::kNotFound) << outcome.status();
  EXPECT_FALSE(began);
}

TEST(StudySettingsTest, DescribeSaysWhatDistinguishesRecords) {
  const StudySettings usual;
  StudySettings goal = usual, server = usual, scanner = usual, preview = usual, preset = usual;
  preview.preview = sensor::Radians(0.5);
  preset.instrument = "Leica RTC360 at 6mm";
  goal.goal = 0.9;
  server.server = "planner:7464";
  scanner.scanner.elevation_max = sensor::Radians(60);
  for (const StudySettings& other : {goal, server, scanner, preview, preset}) {
    EXPECT_NE(other.Describe(), usual.Describe());
  }
  EXPECT_THAT(usual.Describe(), ::testing::Not(::testing::HasSubstr("0 scans")));
  EXPECT_THAT(usual.For("flat-101").Describe(), ::testing::HasSubstr("28 scans"));
}

}  // namespace
}  // namespace vantage::study
