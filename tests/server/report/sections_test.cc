// The parts of a report, of a job that is made up.
#include "server/report/sections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/match.h"
#include "server/conversion/to_proto.h"
#include "server/report/decisions.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const char kHostile[] = "<script>alert(1)</script>";

v1::Scan ScanAt(int number, const Eigen::Vector3d& at, v1::ScanState state) {
  v1::Scan scan;
  scan.set_name("sessions/job/scans/scan-" + std::to_string(number));
  scan.set_display_name("scan " + std::to_string(number));
  scan.set_state(state);
  scan.set_pose_source(number == 1 ? v1::POSE_SOURCE_FIRST_SCAN : v1::POSE_SOURCE_REGISTRATION);
  scan.mutable_create_time()->set_seconds(1'700'000'000 + 600 * number);
  scan.mutable_scanner_model()->set_id("panoramic");
  scan.mutable_scanner_model()->set_range_noise_m(0.002);
  scan.mutable_scanner_model()->set_max_range_m(20);
  scan.set_column_count(360);
  scan.set_row_count(100);
  scan.set_sample_count(30'000);
  if (state != v1::SCAN_STATE_MERGED) return scan;
  *scan.mutable_pose()->mutable_translation() = conversion::WriteVector(at);
  scan.mutable_pose()->mutable_rotation()->set_w(1);
  scan.mutable_merge()->set_obtained_gain_m2(10.0 * number);
  return scan;
}

// A bare room, two scans in the model and one in doubt, all that is hostile named so.
JobRecord Job() {
  JobRecord job;
  job.session.set_name("sessions/job");
  job.session.set_display_name(kHostile);
  job.session.set_model_version(2);
  job.session.mutable_planning_config()->set_required_density_per_m2(2500);
  job.session.mutable_planning_config()->mutable_registration()->set_required_accuracy_m(0.010);
  job.session.mutable_scan_counts()->set_merged_count(2);
  job.session.mutable_scan_counts()->set_doubtful_count(1);
  v1::Rejection& rejection = *job.session.add_rejections();
  rejection.set_radius_m(0.8);
  rejection.set_reason(kHostile);
  const Eigen::Vector3d first(0.2, 0.1, 1.5);
  job.scans = {ScanAt(1, first, v1::SCAN_STATE_MERGED),
               ScanAt(2, {-1, 0.5, 1.5}, v1::SCAN_STATE_MERGED),
               ScanAt(3, first, v1::SCAN_STATE_DOUBTFUL)};
  v1::Registration& aligned = *job.scans[1].mutable_registration();
  aligned.set_rms_residual_m(0.003);
  aligned.set_expected_residual_m(0.003);
  aligned.set_correspondence_count(1000);
  aligned.mutable_verdict()->set_outcome(v1::REGISTRATION_OUTCOME_REGISTERED);
  aligned.mutable_verdict()->set_basis(v1::REGISTRATION_BASIS_SCAN_GEOMETRY);
  aligned.mutable_verdict()->set_error_bound_m(0.0042);
  v1::GainPromise& promise = *job.scans[1].mutable_merge()->mutable_promise();
  promise.set_plan("sessions/job/plans/plan-1");
  promise.set_expected_gain_m2(22);
  promise.set_expected_gain_lower_m2(15);
  promise.set_expected_gain_upper_m2(30);
  v1::SiteChange& change = *job.scans[1].mutable_merge()->add_changes();
  change.set_kind(v1::SITE_CHANGE_KIND_GONE);
  change.set_since(job.scans[0].name());
  change.set_area_m2(0.7);
  job.scans[2].mutable_registration()->mutable_verdict()->set_outcome(
      v1::REGISTRATION_OUTCOME_DOUBTFUL);
  job.scans[2].mutable_registration()->mutable_verdict()->set_basis(
      v1::REGISTRATION_BASIS_RIVAL_POSE);
  job.scans[2].set_display_name(kHostile);
  for (int i = 0; i < 2; ++i) {
    v1::LinkedScan& linked = *job.graph.add_scans();
    linked.set_scan(job.scans[static_cast<size_t>(i)].name());
    linked.set_held(i == 0);
    for (int k = 0; k < 36; ++k) linked.add_covariance(i == 1 && k % 7 == 0 ? 1e-6 : 0);
  }
  v1::ScanLink& link = *job.graph.add_links();
  link.set_first_scan(job.scans[0].name());
  link.set_second_scan(job.scans[1].name());
  link.set_overlap_share(0.6);
  link.set_constrained_direction_count(6);
  job.graph.add_link_test_ratios(0.3);
  v1::Coverage& coverage = *job.coverage.mutable_coverage();
  coverage.set_required_density_per_m2(2500);
  coverage.mutable_area_by_kind_m2()->set_true_surface(98);
  coverage.mutable_area_by_kind_m2()->set_occlusion(1.5);
  coverage.set_area_at_density_m2(96);
  coverage.set_estimated_coverage(0.965);
  coverage.set_rooms_not_entered_count(1);
  v1::Storey& storey = *job.coverage.add_storeys();
  storey.set_floor_z_m(0);
  storey.set_name("shop");
  v1::RegionCoverage& region = *coverage.add_regions();
  region.set_name(std::string(kHostile) + " vault");
  region.set_required_density_per_m2(10'000);
  region.set_estimated_coverage(0.5);
  region.mutable_area_by_kind_m2()->set_true_surface(10);
  v1::SessionEvent accepted;
  accepted.mutable_scan_accepted()->mutable_scan()->CopyFrom(job.scans[2]);
  job.decisions.events.push_back(accepted);
  job.decisions.left_out = 7;
  job.instruments.push_back({job.scans[0].scanner_model(), {}});
  // Made once: it takes longer than all else here.
  static const auto& view =
      *new auto(registration::ModelOf(registration::BareRoom(), registration::PoseAt(first, 0),
                                      registration::ScanSettings(), 0, 1));
  job.view = view;
  job.config.required_density = 2500;
  return job;
}

std::string All(const JobRecord& job, const ReportOptions& options) {
  const Words say(options);
  const Standing standing = MeasureStanding(job, options.required_coverage);
  const std::vector<ReportStorey> storeys = StoreysOf(job);
  Html all = WriteHead(job, say) + WriteSignOff(job, standing, say);
  for (size_t i = 0; i < storeys.size(); ++i) {
    all += WriteFloorPlan(job, storeys, i, i == 0, say);
  }
  all += WriteStations(job, standing, say) + WriteRemaining(job, standing, say) +
         WritePromises(job, say) + WriteInstruments(job, say) + WriteChanges(job, say) +
         WriteDecisions(job, say) + WriteEnd();
  return all.markup();
}

TEST(Sections, NothingThatSomebodyNamedRuns) {
  for (const Language language : {Language::kEnglish, Language::kGerman}) {
    const std::string page = All(Job(), {language, absl::ZeroDuration(), 0.95});
    EXPECT_THAT(page, Not(HasSubstr("<script")));
    EXPECT_THAT(page, HasSubstr("<h1>&lt;script&gt;alert(1)&lt;/script&gt;</h1>"));
    EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(1)&lt;/script&gt; vault"));
    // Nothing is fetched: what is named by an address is in the page itself.
    for (const char* outward : {"src=", "http-equiv=\"refresh", "<link", "url(http", "@import"}) {
      EXPECT_THAT(page, Not(HasSubstr(outward))) << outward;
    }
    size_t references = 0;
    for (size_t at = page.find("href="); at != std::string::npos; at = page.find("href=", at + 1)) {
      EXPECT_TRUE(absl::StartsWith(absl::string_view(page).substr(at), "href=\"data:image/png;"));
      ++references;
    }
    EXPECT_EQ(references, 1U);
  }
}

TEST(Sections, SayWhatWasRequiredAndReached) {
  const std::string page = All(Job(), {});
  EXPECT_THAT(page, HasSubstr("<html lang=\"en\">"));
  EXPECT_THAT(page, HasSubstr("Requirements not met"));  // of the vault
  EXPECT_THAT(page, HasSubstr("complete to 50.0 % where 95.0 % is required"));
  EXPECT_THAT(page, HasSubstr("10.0 mm (LOA30)"));
  EXPECT_THAT(page, HasSubstr("The registration is for planning."));
  EXPECT_THAT(page,
              HasSubstr("is in doubt and not in the model: another pose fits almost as well"));
  EXPECT_THAT(page, HasSubstr("Storey 0 (shop), floor at z = 0.00 m"));
  EXPECT_THAT(page, HasSubstr("expected to bring 22.0 m\u00b2 and brought 20.0 m\u00b2"));
  EXPECT_THAT(page, HasSubstr("within the range"));
  EXPECT_THAT(page, HasSubstr("left, or was opened"));
  EXPECT_THAT(page, HasSubstr("good (30 %)"));
  EXPECT_THAT(page, HasSubstr("Earlier decisions, not listed: 7."));
  EXPECT_THAT(page, HasSubstr("Accepted station 3"));
  EXPECT_THAT(page, HasSubstr("class=\"signatures\""));
  // 1 mm in all directions: 2.8 mm at 95 %.
  EXPECT_THAT(page, HasSubstr("<td class=\"number\">2.8</td>"));
  // Each picture says what it shows.
  EXPECT_THAT(page, HasSubstr("<title>Floor plan of Storey 0 (shop) at 1:"));
}

TEST(Sections, SpeakGerman) {
  const std::string page = All(Job(), {Language::kGerman, absl::Hours(1), 0.95});
  EXPECT_THAT(page, HasSubstr("<html lang=\"de\">"));
  EXPECT_THAT(page, HasSubstr("Anforderungen nicht erf\u00fcllt"));
  EXPECT_THAT(page, HasSubstr("Die Registrierung dient der Planung."));
  EXPECT_THAT(page, HasSubstr("zu 50,0 % vollst\u00e4ndig"));
  EXPECT_THAT(page, HasSubstr("UTC+01:00"));
  EXPECT_THAT(page, Not(HasSubstr("Requirement")));
}

TEST(Sections, WhatIsMetIsSaidSo) {
  JobRecord job = Job();
  job.coverage.mutable_coverage()->mutable_regions(0)->set_estimated_coverage(0.97);
  // Of no surface of it anything is known by the model, which has no such region.
  job.coverage.mutable_coverage()->clear_regions();
  EXPECT_THAT(All(job, {}), HasSubstr("Requirements met"));
  EXPECT_THAT(All(job, {Language::kEnglish, absl::ZeroDuration(), 0.98}),
              HasSubstr("Requirements not met"));
  // Twice as far off as is required.
  for (int k = 0; k < 36; k += 7) {
    job.graph.mutable_scans(1)->set_covariance(k, 5e-5);
  }
  EXPECT_THAT(All(job, {}), HasSubstr("(LOA20) at 95 % where 10.0 mm (LOA30) is required"));
}

TEST(Sections, HowWellAllHangsTogetherIsInNumbers) {
  JobRecord job = Job();
  EXPECT_THAT(All(job, {}), testing::Not(HasSubstr("best chain of links")));
  v1::Connectivity& all = *job.graph.mutable_connectivity();
  all.set_piece_count(1);
  all.set_tied_pair_count(1);
  all.set_mean_path_sigma_m(0.0031);
  all.set_longest_path_sigma_m(0.0045);
  v1::CutScan& cut = *all.add_cut_scans();
  cut.set_scan(job.scans[1].name());
  cut.set_cut_off_scan_count(3);
  const std::string page = All(job, {});
  EXPECT_THAT(page, HasSubstr("know of each other to 3.1 mm in the mean, and to 4.5 mm at worst"));
  EXPECT_THAT(page, HasSubstr("stations whose loss would cut the job: 1"));
  EXPECT_THAT(page, HasSubstr("Without station 2 stations would be apart"));
}

// Of many links the weakest are listed: one that does not fit the others is among them, however
// much surface it has.
TEST(Sections, LinksComeByWhatTheyHold) {
  JobRecord job = Job();
  for (int i = 0; i < 60; ++i) {
    v1::ScanLink& link = *job.graph.add_links();
    link = job.graph.links(0);
    link.set_correspondence_count(100 + i);
    job.graph.add_link_test_ratios(0.3);
  }
  job.graph.mutable_links(0)->set_correspondence_count(1'000'000);
  EXPECT_THAT(All(job, {}), testing::Not(HasSubstr("<td>suspect")));
  EXPECT_THAT(All(job, {}), testing::Not(HasSubstr("1,000,000")));
  job.graph.set_link_test_ratios(0, 1.5);
  EXPECT_THAT(All(job, {}), HasSubstr("suspect (150"));
}

TEST(Sections, AJobWithoutScansHasAReport) {
  JobRecord job;
  job.session.set_name("sessions/empty");
  const std::string page = All(job, {});
  EXPECT_THAT(page, HasSubstr("there is nothing to sign off"));
  EXPECT_THAT(page, HasSubstr("No scan is in the model."));
  EXPECT_THAT(page, HasSubstr("</html>"));
}

TEST(Requirements, LevelsAreThoseOfTheSpecification) {
  EXPECT_STREQ(LevelOf(0.001)->name, "LOA50");
  EXPECT_STREQ(LevelOf(0.0011)->name, "LOA40");
  EXPECT_STREQ(LevelOf(0.015)->name, "LOA30");
  EXPECT_STREQ(LevelOf(0.050)->name, "LOA20");
  EXPECT_STREQ(LevelOf(0.150)->name, "LOA10");
  EXPECT_FALSE(LevelOf(0.151).has_value());
}

TEST(Decisions, AreThoseOfPeopleAndOfTheServerForThem) {
  v1::SessionEvent event;
  EXPECT_FALSE(IsDecision(event));
  event.mutable_scan_received();
  EXPECT_FALSE(IsDecision(event));
  event.mutable_scan_withdrawn();
  EXPECT_TRUE(IsDecision(event));
  event.mutable_plan_ended();
  EXPECT_FALSE(IsDecision(event));
  event.mutable_plan_ended()
      ->mutable_plan()
      ->mutable_result()
      ->mutable_termination()
      ->set_suggested(true);
  EXPECT_TRUE(IsDecision(event));
  event.mutable_upload_ended()->mutable_upload()->set_state(v1::UPLOAD_STATE_COMMITTED);
  EXPECT_FALSE(IsDecision(event));
}

}  // namespace
}  // namespace vantage::report
