#include "server/conversion/check_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "server/contract/error.h"

namespace vantage::conversion {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> Wrong(const absl::Status& status) {
  google::rpc::BadRequest request;
  const auto payload = status.GetPayload("type.googleapis.com/google.rpc.BadRequest");
  if (payload.has_value()) request.ParseFromString(std::string(*payload));
  std::vector<std::string> fields;
  for (const auto& violation : request.field_violations()) fields.push_back(violation.field());
  EXPECT_EQ(fields.empty(), status.ok()) << status;
  return fields;
}

template <typename Request>
Request WithBadId() {
  Request request;
  request.set_request_id("two words");
  return request;
}

TEST(CheckRequest, EveryRequestThatChangesSomethingHasItsIdChecked) {
  const contract::Limits limits;
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::CreateSessionRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::UpdateSessionRequest>())),
              UnorderedElementsAre("request_id", "update_mask"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::DeleteSessionRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::CreateUploadRequest>(), limits)),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::AcceptScanRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::SetScanPoseRequest>())),
              UnorderedElementsAre("request_id", "prior"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::WithdrawScanRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::CreatePlanRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::RejectViewRequest>())),
              UnorderedElementsAre("request_id", "position"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::CreateScannerRequest>())),
              UnorderedElementsAre("request_id", "scanner"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::ClaimViewRequest>())),
              UnorderedElementsAre("request_id", "position"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::RenewClaimRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::ReleaseClaimRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::CancelPlanRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::DeletePlanRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::UpdateScannerRequest>())),
              UnorderedElementsAre("request_id", "update_mask"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::DeleteScannerRequest>())),
              UnorderedElementsAre("request_id"));
  EXPECT_THAT(Wrong(CheckRequest(WithBadId<v1::ImportSessionRequest>(), limits)),
              UnorderedElementsAre("request_id", "data"));
}

TEST(CheckRequest, APlanHasABudgetAndARankingThatThereIs) {
  v1::CreatePlanRequest request;
  EXPECT_TRUE(CheckRequest(request).ok());
  EXPECT_EQ(ReadPlanBudget(request.plan()).seconds, 1);
  request.mutable_plan()->set_work_limit_rays(0);
  request.mutable_plan()->set_ranking(static_cast<v1::Ranking>(9));
  EXPECT_THAT(Wrong(CheckRequest(request)),
              UnorderedElementsAre("plan.work_limit_rays", "plan.ranking"));
  request.mutable_plan()->set_work_limit_rays(7);
  EXPECT_EQ(ReadPlanBudget(request.plan()).work_limit, 7u);
  EXPECT_EQ(ReadPlanBudget(request.plan()).seconds, 0);
  request.mutable_plan()->clear_ranking();
  EXPECT_TRUE(CheckRequest(request).ok());
  for (const int64_t seconds : {0, 3601}) {
    request.mutable_plan()->mutable_time_budget()->set_seconds(seconds);
    EXPECT_THAT(Wrong(CheckRequest(request)), UnorderedElementsAre("plan.time_budget"));
  }
}

TEST(CheckRequest, ARejectionAndAClaimHaveAPlaceAndATime) {
  v1::RejectViewRequest reject;
  reject.mutable_position()->set_y(kNotANumber);
  reject.set_radius_m(kNotANumber);
  reject.mutable_ttl()->set_nanos(5);
  reject.set_reason(std::string(501, 'r'));
  EXPECT_THAT(Wrong(CheckRequest(reject)),
              UnorderedElementsAre("position.y", "radius_m", "ttl", "reason"));
  v1::ClaimViewRequest claim;
  claim.mutable_position();
  EXPECT_TRUE(CheckRequest(claim).ok());
  EXPECT_EQ(ReadTtl(claim), absl::Minutes(30));
  claim.mutable_ttl()->set_seconds(9);
  EXPECT_THAT(Wrong(CheckRequest(claim)), UnorderedElementsAre("ttl"));
  v1::RenewClaimRequest renew;
  renew.mutable_ttl()->set_seconds(86401);
  EXPECT_THAT(Wrong(CheckRequest(renew)), UnorderedElementsAre("ttl"));
  v1::CompareScanPosesRequest compare;
  EXPECT_TRUE(CheckRequest(compare).ok());
  compare.set_max_sample_count(99);
  compare.set_max_surface_count(40'001);
  EXPECT_THAT(Wrong(CheckRequest(compare)),
              UnorderedElementsAre("max_sample_count", "max_surface_count"));
  v1::EvaluateViewRequest evaluate;
  EXPECT_THAT(Wrong(CheckRequest(evaluate)), UnorderedElementsAre("position"));
}

TEST(CheckRequest, AnUploadFitsAndAScannerIsPossible) {
  contract::Limits limits;
  v1::CreateUploadRequest upload;
  v1::UploadTotal& total = *upload.mutable_upload()->mutable_total();
  total.set_encoded_size_bytes(limits.encoded_scan_bytes + 1);
  total.set_sha256("short");
  EXPECT_THAT(Wrong(CheckRequest(upload, limits)),
              UnorderedElementsAre("upload.total.encoded_size_bytes", "upload.total.sha256"));
  total.set_encoded_size_bytes(limits.encoded_scan_bytes);
  total.set_sha256(std::string(32, 's'));
  EXPECT_TRUE(CheckRequest(upload, limits).ok());
  v1::CreateScannerRequest scanner;
  scanner.set_scanner_id("Red One");
  scanner.mutable_scanner()->set_speed_m_per_s(0);
  scanner.mutable_scanner()->mutable_scan_duration()->set_seconds(-1);
  scanner.mutable_scanner()->add_reach()->mutable_min();
  EXPECT_THAT(Wrong(CheckRequest(scanner)),
              UnorderedElementsAre("scanner_id", "scanner.speed_m_per_s", "scanner.scan_duration",
                                   "scanner.reach[0].max"));
}

TEST(CheckRequest, TargetsAreNamedAndSeenSomewhere) {
  v1::TargetSighting good;
  good.set_name("T1");
  good.mutable_in_scan()->set_x(1);
  good.mutable_in_world();
  v1::TargetSighting nameless = good;
  nameless.clear_name();
  v1::TargetSighting nowhere = good;
  nowhere.clear_in_scan();
  v1::TargetSighting vague = good;
  vague.set_sigma_m(2);
  v1::TargetSighting infinite = good;
  infinite.mutable_in_world()->set_x(std::numeric_limits<double>::infinity());
  const std::vector<std::pair<std::vector<v1::TargetSighting>, std::string>> cases = {
      {{nameless}, "upload.targets[0].name"},
      {{nowhere}, "upload.targets[0].in_scan"},
      {{vague}, "upload.targets[0].sigma_m"},
      {{infinite}, "upload.targets[0].in_world.x"},
      {{good, good}, "upload.targets[1].name"},
      {std::vector<v1::TargetSighting>(101, good), "upload.targets"}};
  for (const auto& [targets, field] : cases) {
    v1::CreateUploadRequest request;
    for (const v1::TargetSighting& target : targets)
      *request.mutable_upload()->add_targets() = target;
    EXPECT_THAT(Wrong(CheckRequest(request, contract::Limits())), UnorderedElementsAre(field));
  }
}

// Memory is reserved by it, so what is stated has to be what comes.
TEST(CheckRequest, APriorsFileIsAsLargeAsStated) {
  v1::SetSitePriorRequest request;
  request.set_file("v 0 0 0");
  const std::vector<std::string> without = Wrong(CheckRequest(request));
  for (const int64_t stated : {int64_t{-1}, int64_t{6}, std::numeric_limits<int64_t>::max(),
                               std::numeric_limits<int64_t>::min()}) {
    request.set_uncompressed_size_bytes(stated);
    EXPECT_THAT(Wrong(CheckRequest(request)), testing::Contains("uncompressed_size_bytes"));
  }
  request.set_uncompressed_size_bytes(7);
  EXPECT_EQ(Wrong(CheckRequest(request)), without);
}

TEST(CheckRequest, AnExportHasAFormatThatThereIs) {
  v1::ExportModelRequest request;
  EXPECT_THAT(Wrong(CheckRequest(request)), UnorderedElementsAre("format"));
  request.set_format(v1::EXPORT_FORMAT_ARCHIVE);
  EXPECT_TRUE(CheckRequest(request).ok());
  request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
  EXPECT_TRUE(CheckRequest(request).ok());
  request.add_scans("sessions/job/scans/scan-1");
  EXPECT_THAT(Wrong(CheckRequest(request)), UnorderedElementsAre("scans"));
  request.set_format(v1::EXPORT_FORMAT_SCANS_PLY);
  EXPECT_TRUE(CheckRequest(request).ok());
  for (int i = 0; i < 1000; ++i) request.add_scans("");
  EXPECT_THAT(Wrong(CheckRequest(request)), UnorderedElementsAre("scans"));
}

TEST(CheckRequest, AnUpdateNamesWhatCanChange) {
  v1::UpdateSessionRequest request;
  for (const char* path : {"display_name", "planning_config.confidence", "site_rules"}) {
    request.mutable_update_mask()->add_paths(path);
  }
  EXPECT_THAT(Wrong(CheckRequest(request)), IsEmpty());
  for (const char* path : {"origin", "planning_config.nothing", "display_names"}) {
    request.mutable_update_mask()->add_paths(path);
  }
  EXPECT_EQ(Wrong(CheckRequest(request)).size(), 3u);
}

// What was accepted, and failed only when it was planned with.
TEST(CheckRequest, ASessionWhoseRegistrationIsImpossibleIsRefused) {
  v1::CreateSessionRequest request;
  v1::RegistrationConfig& config =
      *request.mutable_session()->mutable_planning_config()->mutable_registration();
  config.set_required_accuracy_m(5);
  config.set_normal_sigma_rad(0);
  config.set_draw_count(16);
  EXPECT_THAT(Wrong(CheckRequest(request)),
              UnorderedElementsAre("session.planning_config.registration.required_accuracy_m",
                                   "session.planning_config.registration.normal_sigma_rad",
                                   "session.planning_config.registration.draw_count"));
}

}  // namespace
}  // namespace vantage::conversion
