#include "client/library/error.h"

#include <gmock/gmock.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include "client/cli/command.h"

namespace vantage {
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
  first->set_field("session.planning_config.required_density");
  first->set_description("must be > 0");
  auto* second = bad.add_field_violations();
  second->set_field("session.model_config.voxel_size");
  second->set_description("must be in [0.01, 0.5]");
  const absl::Status status = FromRpc(Failure(grpc::StatusCode::INVALID_ARGUMENT,
                                              "the session is not valid", bad, Info("BAD_FIELD")),
                                      "here:1");
  const Explanation e = Explain(status);
  EXPECT_EQ(e.cause, "the session is not valid");
  EXPECT_THAT(e.violations, ElementsAre("session.planning_config.required_density: must be > 0",
                                        "session.model_config.voxel_size: must be in [0.01, 0.5]"));
  EXPECT_EQ(e.reason, "BAD_FIELD");
  EXPECT_FALSE(e.fix.empty());
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kRefused);
}

TEST(Error, NoServerSaysWhichAndWhatToDo) {
  const absl::Status status =
      FromRpc(grpc::Status(grpc::StatusCode::UNAVAILABLE, "connection refused"), "far:7464");
  const Explanation e = Explain(status);
  EXPECT_THAT(e.cause, HasSubstr("far:7464"));
  EXPECT_THAT(e.fix, HasSubstr("--server"));
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kUnreachable);
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
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kTryAgain);
}

TEST(Error, NotFoundPointsToTheList) {
  google::rpc::ResourceInfo resource;
  resource.set_resource_name("sessions/nowhere");
  const absl::Status status = FromRpc(
      Failure(grpc::StatusCode::NOT_FOUND, "no such session", resource, Info("SESSION_NOT_FOUND")),
      "here:1");
  EXPECT_THAT(Explain(status).fix, HasSubstr("vantage session list"));
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kNotFound);
}

TEST(Error, OurOwnKeepTheirFix) {
  const Explanation e = Explain(WithFix(absl::InvalidArgumentError("no pose."), "give one"));
  EXPECT_EQ(e.cause, "no pose");
  EXPECT_EQ(e.fix, "give one");
  EXPECT_TRUE(WithFix(absl::OkStatus(), "nothing").ok());
}

TEST(Error, EveryCodeHasAnExitCode) {
  for (int code = 1; code <= 16; ++code) {
    EXPECT_NE(ExitCodeOf(absl::Status(static_cast<absl::StatusCode>(code), "x")), ExitCode::kOk)
        << code;
  }
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), ExitCode::kOk);
}

}  // namespace
}  // namespace vantage
