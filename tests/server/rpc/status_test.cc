// What an error carries to the client: above all, when it may ask again by itself.
#include "server/rpc/call/status.h"

#include <gtest/gtest.h>

#include <string>

#include "server/contract/error.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

bool SaysWhenToRetry(const grpc::Status& status) {
  for (const google::protobuf::Any& any : fixture::Details(status)) {
    if (any.Is<google::rpc::RetryInfo>()) return true;
  }
  return false;
}

grpc::Status Sent(const absl::Status& status) {
  grpc::ServerContext context;
  return ToGrpcStatus(status, context);
}

TEST(SentStatus, SaysWhenToRetryWhereWaitingHelpsOnly) {
  const absl::Status full =
      contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "STORE_FULL", "no room");
  EXPECT_FALSE(SaysWhenToRetry(Sent(full)));
  EXPECT_EQ(fixture::InfoOf(Sent(full)).reason(), "STORE_FULL");
  EXPECT_FALSE(SaysWhenToRetry(Sent(absl::ResourceExhaustedError("no reason given"))));
  EXPECT_FALSE(SaysWhenToRetry(Sent(absl::DataLossError("lost"))));
  EXPECT_TRUE(SaysWhenToRetry(Sent(absl::UnavailableError("the medium fails"))));
  EXPECT_TRUE(SaysWhenToRetry(Sent(contract::Retryable(absl::StatusCode::kResourceExhausted,
                                                       "SERVER_BUSY", "busy", absl::Seconds(2)))));
}

// Limits that last until somebody makes room.
class Limits : public testing::Test {
 protected:
  static server::ServerOptions One() {
    server::ServerOptions options;
    options.limits.sessions = 1;
    options.limits.scanners_per_session = 1;
    options.limits.claims_per_session = 1;
    options.limits.plans_per_session = 1;
    options.limits.scans_per_session = 1;
    return options;
  }
  static void ExpectLasting(const grpc::Status& status, const std::string& reason) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << reason;
    EXPECT_EQ(fixture::InfoOf(status).reason(), reason);
    EXPECT_FALSE(SaysWhenToRetry(status)) << reason;
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make(), One()};
};

TEST_F(Limits, ThatLastComeWithoutADelay) {
  script_.EndPlans();
  const std::string session = server_.OpenRoom("job");
  {
    grpc::ClientContext context;
    v1::CreateSessionResponse response;
    ExpectLasting(server_.sessions->CreateSession(&context, {}, &response), "TOO_MANY_SESSIONS");
  }
  {
    grpc::ClientContext context;
    v1::CreateUploadRequest request;
    request.set_parent(session);
    v1::CreateUploadResponse response;
    ExpectLasting(server_.scans->CreateUpload(&context, request, &response), "TOO_MANY_SCANS");
  }
  grpc::Status status;
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    v1::CreateScannerRequest request;
    request.set_parent(session);
    request.set_scanner_id(i == 0 ? "red" : "blue");
    request.mutable_scanner();
    v1::CreateScannerResponse response;
    status = server_.fleet->CreateScanner(&context, request, &response);
  }
  ExpectLasting(status, "TOO_MANY_SCANNERS");
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    v1::ClaimViewRequest request;
    request.set_parent(session);
    request.set_scanner(session + "/scanners/red");
    request.mutable_position()->set_x(5 * i);
    v1::ClaimViewResponse response;
    status = server_.fleet->ClaimView(&context, request, &response);
  }
  ExpectLasting(status, "CLAIMS_FULL");
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    v1::CreatePlanRequest request;
    request.set_parent(session);
    v1::CreatePlanResponse response;
    status = server_.plans->CreatePlan(&context, request, &response);
  }
  ExpectLasting(status, "PLANS_FULL");
}

}  // namespace
}  // namespace vantage::rpc
