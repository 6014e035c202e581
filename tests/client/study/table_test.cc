#include "client/study/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/study/page.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/small_scenes.h"

namespace vantage::study {
namespace {

using study_records::v1::JobRecord;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kMost = 5;

// A job that covers this much after each scan; `lost` counts from 1.
JobRecord Job(const std::string& planner, uint64_t seed, const std::vector<double>& covered,
              int lost = 0) {
  JobRecord record;
  record.set_scene("flat-101");
  record.set_planner(planner);
  record.set_seed(seed);
  record.set_attainable_area(100);
  double before = 0;
  for (const double c : covered) {
    study_records::v1::ScanRecord& scan = *record.add_scans();
    scan.set_number(record.scans_size());
    scan.mutable_position()->set_x(scan.number());
    scan.set_merged(scan.number() != lost);
    scan.set_minutes(3 * scan.number());
    scan.set_gained(100 * (c - before));
    scan.set_best(200 * (c - before));
    scan.set_covered(c);
    before = c;
  }
  return record;
}

std::vector<JobRecord> Jobs() {
  return {Job("ours", 1, {0.5, 0.9, 0.96}),
          Job("ours", 2, {0.5, 0.5, 0.9, 0.95}, 2),
          Job("ours", 3, {0.4, 0.96}),
          Job("oracle", 1, {0.5, 0.97}),
          Job("oracle", 2, {0.5, 0.97}),
          Job("oracle", 3, {0.4, 0.96}),
          Job("random", 1, {0.5, 0.6, 0.6, 0.7}),
          Job("random", 2, {0.5, 0.6, 0.7, 0.8, 0.95}),
          Job("random", 3, {0.4, 0.5})};
}

const study_records::v1::Row& RowOf(const study_records::v1::Table& table,
                                    const std::string& planner) {
  for (const study_records::v1::Row& row : table.rows()) {
    if (row.planner() == planner) return row;
  }
  ADD_FAILURE() << "no row of " << planner;
  return table.rows(0);
}

const study_records::v1::Figure& FigureOf(const study_records::v1::Table& table,
                                          const std::string& name) {
  for (const study_records::v1::Figure& figure : table.figures()) {
    if (figure.name() == name) return figure;
  }
  ADD_FAILURE() << "no figure " << name;
  return table.figures(0);
}

TEST(StudyTable, CountsScansAndArea) {
  EXPECT_EQ(ScansUntil(Job("ours", 1, {0.5, 0.95}), 0.95, kMost), 2);
  EXPECT_EQ(ScansUntil(Job("ours", 1, {0.5, 0.94}), 0.95, kMost), kMost + 1);
  // 0.5 + 4 * 0.9: a job that ended stays where it was.
  EXPECT_DOUBLE_EQ(AreaUnderCurve(Job("ours", 1, {0.5, 0.9}), kMost), 4.1 / 5);
  EXPECT_EQ(AreaUnderCurve(JobRecord(), kMost), 0);
}

TEST(StudyTable, RowsAreMediansOverTheSeeds) {
  const std::vector<JobRecord> jobs = Jobs();
  const auto table = MakeTable(jobs, 0.95, std::vector<int>(jobs.size(), kMost), "");
  ASSERT_EQ(table.rows_size(), 3);
  const study_records::v1::Row& ours = RowOf(table, "ours");
  EXPECT_EQ(ours.jobs(), 3);
  EXPECT_EQ(ours.reached(), 3);
  EXPECT_EQ(ours.scans95(), 3);  // of 3, 4, 2
  EXPECT_EQ(ours.minutes95(), 9);
  EXPECT_EQ(ours.scans(), 9);
  EXPECT_EQ(ours.lost(), 1);
  EXPECT_TRUE(ours.winner());
  const study_records::v1::Row& random = RowOf(table, "random");
  EXPECT_EQ(random.reached(), 1);
  EXPECT_FALSE(random.has_scans95()) << "two of three never got there";
  EXPECT_EQ(random.most_scans(), kMost);
  EXPECT_FALSE(random.has_minutes95());
  EXPECT_FALSE(random.winner());
  EXPECT_FALSE(RowOf(table, "oracle").winner()) << "it knows the scene";
}

TEST(StudyTable, SaysHowManyPlansNeededMoreThanTheirBudget) {
  JobRecord job = Job("ours-0.2s", 1, {0.5, 0.8, 0.9});
  const double budgets[] = {0.2, 0.8};
  const int attempts[] = {1, 3};
  for (int i = 0; i < 2; ++i) {
    job.mutable_scans(i + 1)->set_plan_budget(budgets[i]);
    job.mutable_scans(i + 1)->set_plan_attempts(attempts[i]);
    job.mutable_scans(i + 1)->set_plan_seconds(i == 0 ? 0.2 : 1.4);
  }
  const auto table = MakeTable({job, Job("random", 1, {0.5, 0.6})}, 0.95, {kMost, kMost}, "");
  EXPECT_EQ(RowOf(table, "ours-0.2s").budgeted(), 2);
  EXPECT_EQ(RowOf(table, "ours-0.2s").over_budget(), 1);
  EXPECT_DOUBLE_EQ(RowOf(table, "ours-0.2s").plan_seconds(), 0.8);
  EXPECT_EQ(RowOf(table, "random").budgeted(), 0);
  simulated_job::Site site;
  site.name = "flat-101";
  site.mesh = simulation::BoxRoom({4, 3, 2.7}).mesh;
  EXPECT_THAT(StudyPage(table, {job}, {DrawFloorPlan(site, kMost)}, 0.95), HasSubstr("1 of 2"));
}

TEST(StudyTable, FiguresCompareSeedBySeed) {
  const std::vector<JobRecord> jobs = Jobs();
  const auto table = MakeTable(jobs, 0.95, std::vector<int>(jobs.size(), kMost), "");
  EXPECT_EQ(FigureOf(table, "study.scans95_over_oracle").value(), 1);  // of 1, 2, 0
  EXPECT_EQ(FigureOf(table, "study.lost_scans").value(), 1);
  EXPECT_FALSE(FigureOf(table, "study.scans_vs_spacing").has_value()) << "nothing to compare with";
  EXPECT_FALSE(FigureOf(table, "study.budget200ms_auc").has_value());
}

study_records::v1::Table TableOf(const std::vector<JobRecord>& jobs) {
  return MakeTable(jobs, 0.95, std::vector<int>(jobs.size(), kMost), "");
}

TEST(StudyTable, AJobThatNeverGotThereCountsAsInfinitelyLong) {
  const std::vector<double> never = {0.5, 0.9, 0.9, 0.9, 0.9};
  const auto half =
      TableOf({Job("ours", 1, {0.5, 0.96}), Job("ours", 2, {0.96}), Job("ours", 3, never)});
  EXPECT_EQ(RowOf(half, "ours").minutes95(), 6) << "of 6, 3 and never, not of 6 and 3";
  EXPECT_EQ(RowOf(half, "ours").scans95(), 2);
  const auto even = TableOf({Job("ours", 1, {0.5, 0.96}), Job("ours", 2, never)});
  EXPECT_FALSE(RowOf(even, "ours").has_minutes95());
  EXPECT_FALSE(RowOf(even, "ours").has_scans95());
  EXPECT_FALSE(RowOf(even, "ours").winner());
}

TEST(StudyTable, FiguresAreBoundsWhereOneDidNotGetThere) {
  const std::vector<double> never = {0.5, 0.9, 0.9, 0.9, 0.9};
  const auto stated = [](const std::vector<JobRecord>& jobs, const std::string& name) {
    const auto table = TableOf(jobs);
    const study_records::v1::Figure& figure = FigureOf(table, "study." + name);
    EXPECT_FALSE(figure.has_value()) << figure.stated();
    return figure.stated();
  };
  const JobRecord ours = Job("ours", 1, {0.5, 0.9, 0.96});
  const JobRecord lame = Job("ours", 1, never);
  EXPECT_EQ(stated({lame, Job("oracle", 1, {0.5, 0.96})}, "scans95_over_oracle"), "at least +4");
  EXPECT_EQ(stated({ours, Job("oracle", 1, never)}, "scans95_over_oracle"), "at most -3");
  EXPECT_EQ(stated({lame, Job("oracle", 1, never)}, "scans95_over_oracle"),
            "not reached by either");
  EXPECT_EQ(stated({lame, Job("spacing", 1, {0.5, 0.5, 0.96})}, "scans_vs_spacing"), "at least 2");
  EXPECT_EQ(stated({ours, Job("spacing", 1, never)}, "scans_vs_spacing"), "at most 0.5");
  EXPECT_EQ(stated({lame, Job("spacing", 1, never)}, "scans_vs_spacing"), "not reached by either");
  EXPECT_EQ(stated({ours}, "scans_vs_spacing"), "not run");

  // One scene that says nothing hides no other.
  JobRecord hall = ours;
  JobRecord known = Job("oracle", 1, {0.5, 0.96});
  hall.set_scene("hall-101");
  known.set_scene("hall-101");
  const auto two = TableOf({lame, Job("oracle", 1, never), hall, known});
  EXPECT_EQ(FigureOf(two, "study.scans95_over_oracle").value(), 1);
  EXPECT_EQ(FigureOf(two, "study.scans95_over_oracle").stated(), "+1 where one reached it");
  EXPECT_FALSE(FigureOf(two, "site.storeys3.scans").has_value()) << "no house among them";
}

TEST(StudyTable, ComparesWithWhoStandsWhereItIsExpectedAndWithASurveyor) {
  const auto table = TableOf(
      {Job("ours", 1, {0.5, 0.8, 0.92, 0.96}), Job("oracle", 1, {0.6, 0.91, 0.96}),
       Job("oracle-expected", 1, {0.5, 0.96}), Job("surveyor", 1, {0.5, 0.6, 0.7, 0.8, 0.96})});
  EXPECT_EQ(FigureOf(table, "study.scans95_over_oracle").value(), 1);
  EXPECT_EQ(FigureOf(table, "study.scans95_over_oracle_expected").value(), 2);
  EXPECT_EQ(FigureOf(table, "study.scans90_over_oracle").value(), 1);
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.scans95_vs_surveyor").value(), 4.0 / 5);
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.auc_over_oracle").value(),
                   (0.5 + 0.8 + 0.92 + 2 * 0.96) / (0.6 + 0.91 + 3 * 0.96));
  EXPECT_EQ(FigureOf(table, "study.covered8_over_octomap").stated(), "not run");
}

TEST(StudyTable, CoverageAfterEightScansIsThatOfTheWorstScene) {
  std::vector<double> ours(10, 0.5), best(10, 0.5), rival(6, 0.5);
  ours[7] = 0.72;
  best[7] = 0.8;
  rival[5] = 0.6;  // ended
  std::vector<JobRecord> jobs = {Job("ours", 1, ours), Job("oracle", 1, best),
                                 Job("octomap", 1, rival), Job("ours", 1, best),
                                 Job("oracle", 1, best)};
  jobs[3].set_scene("hall-101");
  jobs[4].set_scene("hall-101");
  const auto table = MakeTable(jobs, 0.95, std::vector<int>(jobs.size(), 10), "");
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.covered8_over_oracle").value(), 0.72 / 0.8);
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.covered8_over_octomap").value(), 0.72 / 0.6);
  EXPECT_THAT(FigureOf(table, "study.covered8_over_oracle").detail(),
              HasSubstr("flat-101: 0.720 of 0.800; hall-101: 0.800 of 0.800"));
}

// A room that was seen and entered by these scans; 0: never.
void AddRoom(JobRecord& job, int seen, int entered) {
  study_records::v1::RoomRecord& room = *job.add_rooms();
  if (seen > 0) room.set_seen(seen);
  if (entered > 0) room.set_entered(entered);
}

TEST(StudyTable, WaitsAreScansBetweenTheFirstSightOfADoorAndTheFirstScanBehindIt) {
  JobRecord ours = Job("ours", 1, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  AddRoom(ours, 0, 1);  // where it began
  AddRoom(ours, 1, 2);  // the next scan
  AddRoom(ours, 2, 7);
  AddRoom(ours, 0, 4);  // seen from inside first
  JobRecord rival = Job("octomap", 1, {0.1, 0.2, 0.3});
  AddRoom(rival, 1, 3);
  const auto table = TableOf({ours, rival});
  EXPECT_EQ(FigureOf(table, "study.rooms.wait").value(), 0) << "of 0, 4 and 0";
  EXPECT_EQ(FigureOf(table, "study.rooms.wait_worst").value(), 4);
  EXPECT_THAT(FigureOf(table, "study.rooms.wait").detail(),
              HasSubstr("octomap: 1 over 1 rooms, 0 never entered"));

  AddRoom(ours, 1, 0);
  AddRoom(ours, 2, 0);
  AddRoom(ours, 0, 0);  // nobody knows of it
  const auto with_others = TableOf({ours});
  EXPECT_EQ(FigureOf(with_others, "study.rooms.wait").value(), 4) << "of 0, 0, 4, 5+ and 6+";
  EXPECT_EQ(FigureOf(with_others, "study.rooms.wait_worst").stated(), "at least 6");
  EXPECT_THAT(FigureOf(with_others, "study.rooms.wait").detail(), HasSubstr("2 never entered"));
  EXPECT_EQ(FigureOf(TableOf({Job("ours", 1, {0.1})}), "study.rooms.wait").stated(), "not run");
}

TEST(StudyTable, PromisesAreHeldAgainstWhatCameByTheBasisOfThePlace) {
  JobRecord job = Job("ours", 1, {0.2, 0.3, 0.5, 0.6, 0.7}, 5);
  const double predicted[] = {20, 10, 30, 99};
  for (int i = 0; i < 4; ++i) job.mutable_scans(i + 1)->set_predicted(predicted[i]);
  const auto tried = [&](int scan, double chance, bool free) {
    study_records::v1::ExpectedPlace& place = *job.mutable_scans(scan - 1)->add_expected_places();
    place.set_chance(chance);
    place.set_free(free);
  };
  tried(2, 0.9, false);  // and went to a place that is known
  tried(3, 0.9, false);
  tried(3, 0.9, true);
  tried(5, 0.5, true);  // the lost one
  const auto table = TableOf({job});
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.expected_over_obtained.known").value(),
                   (20.0 + 30.0) / (10.0 + 10.0));
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.expected_over_obtained.expected").value(), 10.0 / 20.0);
  EXPECT_DOUBLE_EQ(FigureOf(table, "study.expected_places_free").value(), 2.0 / 4 - 3.2 / 4);
  EXPECT_THAT(FigureOf(table, "study.expected_places_free").detail(), HasSubstr("2 of 4 free"));
  EXPECT_EQ(FigureOf(TableOf({Job("ours", 1, {0.5})}), "study.expected_places_free").stated(),
            "not run");
}

TEST(StudyTable, ForecastsAreHeldAgainstWhatCameByArea) {
  JobRecord job = Job("ours", 1, {0.2, 0.3, 0.5, 0.6, 0.7}, 5);
  struct Case {
    double expected, lower, upper, brought;
  };
  const Case cases[] = {{30, 20, 40, 35}, {10, 8, 12, 14}, {10, 5, 25, 25}};
  for (int i = 0; i < 3; ++i) {
    study_records::v1::ScanRecord& scan = *job.mutable_scans(i + 1);
    scan.set_predicted(cases[i].expected);
    scan.set_model_gain(10);
    scan.mutable_forecast()->mutable_by_kind()->set_true_surface(10);
    scan.mutable_forecast()->set_lower(cases[i].lower);
    scan.mutable_forecast()->set_upper(cases[i].upper);
    scan.set_brought(cases[i].brought);
  }
  job.mutable_scans(4)->set_predicted(100);  // the lost one brought nothing
  job.mutable_scans(4)->mutable_forecast()->set_upper(200);
  const auto table = TableOf({job});
  EXPECT_DOUBLE_EQ(FigureOf(table, "promise.interval80").value(), 0.8);
  EXPECT_DOUBLE_EQ(FigureOf(table, "promise.width").value(), 20.0 / 30);
  EXPECT_DOUBLE_EQ(FigureOf(table, "promise.within25").value(), 0.6);
  // Widths 20, 4 and 20, and two metres too much, ten times over; by a factor on 10 m2 all are 9.5
  // wide, and 35, 14 and 25 are more than 15.2 by 19.8 and 9.8.
  EXPECT_NEAR(FigureOf(table, "promise.winkler").value(),
              (20 + 4 + 20 + 20) / (3 * 9.5 + 10 * (19.8 + 9.8)), 1e-9);
  EXPECT_THAT(FigureOf(table, "promise.width").detail(), HasSubstr("3 scans, 50 m2 expected"));
  EXPECT_EQ(FigureOf(TableOf({Job("ours", 1, {0.5})}), "promise.width").stated(), "not run");
}

TEST(StudyTable, HousesHaveAFigureOfTheirOwn) {
  std::vector<JobRecord> jobs = {Job("ours", 1, {0.5, 0.6, 0.7, 0.96}),
                                 Job("oracle", 1, {0.5, 0.96})};
  for (const char* scene : {"house-201", "hall-201"}) {
    jobs.push_back(Job("ours", 1, {0.5, scene[1] == 'o' ? 0.96 : 0.5, 0.96}));
    jobs.push_back(Job("oracle", 1, {0.5, 0.96}));
    jobs[jobs.size() - 2].set_scene(scene);
    jobs.back().set_scene(scene);
  }
  const auto table = TableOf(jobs);
  EXPECT_EQ(FigureOf(table, "site.storeys3.scans").value(), 0) << "and not the hall's or flat's";
  EXPECT_EQ(FigureOf(table, "study.scans95_over_oracle").value(), 2);
}

TEST(StudyTable, AMedianIsExactWhateverTheSlowestJobsCameTo) {
  const std::vector<double> never = {0.5, 0.9, 0.9, 0.9, 0.9};
  const auto table = TableOf({Job("ours", 1, {0.5, 0.96}), Job("ours", 2, {0.5, 0.9, 0.96}),
                              Job("ours", 3, never), Job("oracle", 1, {0.5, 0.96}),
                              Job("oracle", 2, {0.5, 0.96}), Job("oracle", 3, {0.96})});
  EXPECT_EQ(FigureOf(table, "study.scans95_over_oracle").value(), 1) << "of 0, 1 and 5 or more";
}

TEST(StudyTable, BudgetIsHeldAgainstWhatWasRun) {
  const JobRecord quick = Job("ours-0.2s", 1, {0.5, 0.5, 0.5, 0.5, 0.5});
  const JobRecord second = Job("ours", 1, {0.8, 0.8, 0.8, 0.8, 0.8});
  const auto small = TableOf({second, quick});
  EXPECT_DOUBLE_EQ(FigureOf(small, "study.budget200ms_auc").value(), 1 - 0.5 / 0.8);
  EXPECT_THAT(FigureOf(small, "study.budget200ms_auc").detail(), HasSubstr("against ours (1"));
  const auto whole = TableOf({second, quick, Job("ours-complete", 1, {1.0, 1.0, 1.0, 1.0, 1.0})});
  EXPECT_DOUBLE_EQ(FigureOf(whole, "study.budget200ms_auc").value(), 0.5);
  EXPECT_THAT(FigureOf(whole, "study.budget200ms_auc").detail(),
              HasSubstr("against ours-complete"));
}

TEST(StudyTable, LossesAreOfEveryPlannerWithOurRule) {
  const auto table =
      TableOf({Job("ours", 1, {0.5, 0.6}, 2), Job("ours-0.2s", 1, {0.5, 0.6, 0.7}, 2),
               Job("ours-complete", 1, {0.5}), Job("ours-overlap", 1, {0.5, 0.6}, 2),
               Job("ours-unchecked", 1, {0.5, 0.6}, 2), Job("ours-paper", 1, {0.5, 0.6}, 2),
               Job("random", 1, {0.5, 0.6}, 2)});
  EXPECT_EQ(FigureOf(table, "study.lost_scans").value(), 2);
  EXPECT_THAT(FigureOf(table, "study.lost_scans").detail(), HasSubstr("of 6 scans in 3 jobs"));
  EXPECT_THAT(FigureOf(table, "study.lost_scans").detail(), HasSubstr("1 of 2 in 1"));
}

TEST(StudyPage, StandsAlone) {
  std::vector<JobRecord> jobs = Jobs();
  jobs[0].set_ended("<b>&");
  const auto table = MakeTable(jobs, 0.95, std::vector<int>(jobs.size(), kMost), "a < b & \"c\"");
  simulated_job::Site site;
  site.name = "flat-101";
  site.mesh = simulation::BoxRoom({4, 3, 2.7}).mesh;
  const std::string page = StudyPage(table, jobs, {DrawFloorPlan(site, kMost)}, 0.95);
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("a &lt; b &amp; &quot;c&quot;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("href")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  for (const char* planner : {"ours", "oracle", "random"}) {
    EXPECT_THAT(page, HasSubstr(std::string(planner) + ", seed 1"));
  }
}

TEST(StudyPage, CutOfABoxIsItsPerimeter) {
  double length = 0;
  for (const auto& [a, b] : CutMesh(simulation::BoxRoom({4, 3, 2.7}).mesh, 1.0))
    length += (b - a).norm();
  EXPECT_NEAR(length, 2 * (4 + 3), 1e-5);
  EXPECT_TRUE(CutMesh(simulation::BoxRoom({4, 3, 2.7}).mesh, 3.0).empty());
}

}  // namespace
}  // namespace vantage::study
