#include "client/library/error.h"

#include <gmock/gmock.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "client/cli/command.h"

namespace vantage::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename... Details>
grpc::Status Failure(grpc::StatusCode code, const std::string& message, const Details&... details) {
  google::rpc::Status status;
  status.set_code(code);
  status.set_message(message);
  (status.add_details()->PackFrom(details), ...);
  return {code, message, status.SerializeAsString()};
}

google::rpc::ErrorInfo Info(const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain("vantage");
  return info;
}

TEST(Error, ListsEveryViolation) {
  google::rpc::BadRequest bad;
  auto* first = bad.add_field_violations();
  first->set_field("session.planning_config.required_density_per_m2");
  first->set_description("must be > 0");
  auto* second = bad.add_field_violations();
  second->set_field("session.model_config.voxel_size_m");
  second->set_description("must be in [0.01, 0.5]");
  const absl::Status status = FromRpc(Failure(grpc::StatusCode::INVALID_ARGUMENT,
                                              "the session is not valid", bad, Info("BAD_FIELD")),
                                      "here:1");
  const Explanation e = Explain(status);
  EXPECT_EQ(e.cause, "the session is not valid");
  EXPECT_THAT(e.violations,
              ElementsAre("session.planning_config.required_density_per_m2: must be > 0",
                          "session.model_config.voxel_size_m: must be in [0.01, 0.5]"));
  EXPECT_EQ(e.reason, "BAD_FIELD");
  EXPECT_FALSE(e.fix.empty());
  EXPECT_EQ(cli::ExitCodeOf(status), cli::ExitCode::kRefused);
}

TEST(Error, NoServerSaysWhichAndWhatToDo) {
  const absl::Status status =
      FromRpc(grpc::Status(grpc::StatusCode::UNAVAILABLE, "connection refused"), "far:7464");
  const Explanation e = Explain(status);
  EXPECT_THAT(e.cause, HasSubstr("far:7464"));
  EXPECT_THAT(e.fix, HasSubstr("--server"));
  EXPECT_EQ(cli::ExitCodeOf(status), cli::ExitCode::kUnreachable);
}

TEST(Error, LimitsSayWhenToComeBack) {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(2);
  retry.mutable_retry_delay()->set_nanos(500'000'000);
  const absl::Status status = FromRpc(Failure(grpc::StatusCode::RESOURCE_EXHAUSTED,
                                              "too many sessions", retry, Info("SESSIONS_LIMIT")),
                                      "here:1");
  const Explanation e = Explain(status);
  EXPECT_EQ(e.retry_seconds, 2.5);
  EXPECT_THAT(e.fix, HasSubstr("2.5 s"));
  EXPECT_EQ(cli::ExitCodeOf(status), cli::ExitCode::kTryAgain);
}

TEST(Error, SaysWhoseTheViewIsAndWhichPieceIsNext) {
  v1::ClaimConflict conflict;
  conflict.set_claim("sessions/s/claims/c");
  conflict.set_same_place(true);
  conflict.mutable_alternative()->set_model_gain_m2(1.5);
  const Explanation claimed = Explain(FromRpc(
      Failure(grpc::StatusCode::ALREADY_EXISTS, "claimed by red", conflict, Info("CLAIMED")),
      "here:1"));
  ASSERT_TRUE(claimed.claim_conflict.has_value());
  EXPECT_EQ(claimed.claim_conflict->claim(), "sessions/s/claims/c");
  EXPECT_TRUE(claimed.claim_conflict->same_place());
  EXPECT_EQ(claimed.claim_conflict->alternative().model_gain_m2(), 1.5);
  EXPECT_FALSE(claimed.expected_piece.has_value());

  v1::ExpectedPiece expected;
  expected.set_sequence(3);
  expected.set_offset(768);
  const Explanation gap = Explain(FromRpc(
      Failure(grpc::StatusCode::OUT_OF_RANGE, "a gap", expected, Info("UPLOAD_GAP")), "here:1"));
  ASSERT_TRUE(gap.expected_piece.has_value());
  EXPECT_EQ(gap.expected_piece->sequence(), 3);
  EXPECT_EQ(gap.expected_piece->offset(), 768);
}

TEST(Error, NotFoundPointsToTheList) {
  const std::pair<const char*, const char*> named[] = {
      {"sessions/nowhere", "vantage session list"},
      {"sessions/a/scans/b", "vantage scan list"},
      {"sessions/a/scanners/b", "vantage scanner list"},
      {"sessions/a/rejections/b", "vantage rejection list"},
      {"sessions/a/uploads/b", "vantage upload list"},
      {"sessions/a/stations/b", "vantage station list"},
      {"sessions/a/claims/b", "vantage claim list"},
      {"sessions/a/plans/b", "vantage plan"},
  };
  for (const auto& [name, fix] : named) {
    google::rpc::ResourceInfo resource;
    resource.set_resource_name(name);
    const absl::Status status =
        FromRpc(Failure(grpc::StatusCode::NOT_FOUND, "there is none", resource, Info("NOT_FOUND")),
                "here:1");
    EXPECT_THAT(Explain(status).fix, HasSubstr(fix)) << name;
    EXPECT_EQ(cli::ExitCodeOf(status), cli::ExitCode::kNotFound);
  }
}

TEST(Error, OurOwnKeepTheirFix) {
  const Explanation e = Explain(WithFix(absl::InvalidArgumentError("no pose."), "give one"));
  EXPECT_EQ(e.cause, "no pose");
  EXPECT_EQ(e.fix, "give one");
  EXPECT_TRUE(WithFix(absl::OkStatus(), "nothing").ok());
}

TEST(Error, EveryCodeHasAnExitCode) {
  for (int code = 1; code <= 16; ++code) {
    EXPECT_NE(cli::ExitCodeOf(absl::Status(static_cast<absl::StatusCode>(code), "x")),
              cli::ExitCode::kOk)
        << code;
  }
  EXPECT_EQ(cli::ExitCodeOf(absl::OkStatus()), cli::ExitCode::kOk);
}

}  // namespace
}  // namespace vantage::client
