// What an error carries to the client: above all, when it may ask again by itself.
#include "server/rpc/call/status.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "google/rpc/error_details.pb.h"
#include "server/contract/error.h"
#include "tests/server/fixture/bare_server.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

// The one detail of a kind; fails the test where there is none.
template <typename Detail>
Detail DetailOf(const grpc::Status& status) {
  Detail detail;
  for (const google::protobuf::Any& any : fixture::Details(status)) {
    if (any.UnpackTo(&detail)) return detail;
  }
  ADD_FAILURE() << "no " << Detail::descriptor()->full_name();
  return detail;
}

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

// As a client has it.
fixture::BareAnswer Received(const absl::Status& status) {
  fixture::BareServer server;
  return server.Call(
      [&](grpc::ServerContextBase& context) { return ToGrpcStatus(status, context); });
}

// The delay in the trailer that gRPC's own retry heeds, ms; empty where there is none.
std::string Pushback(const fixture::BareAnswer& answer) {
  const auto found = answer.trailers.find("grpc-retry-pushback-ms");
  return found == answer.trailers.end() ? "" : found->second;
}

TEST(SentStatus, OkSaysNothing) {
  const grpc::Status sent = Sent(absl::OkStatus());
  EXPECT_TRUE(sent.ok());
  EXPECT_TRUE(sent.error_details().empty());
}

TEST(SentStatus, EveryCodeIsItselfWithItsNameAsReason) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status(static_cast<absl::StatusCode>(code), "what happened");
    const grpc::Status sent = Sent(status);
    EXPECT_EQ(static_cast<int>(sent.error_code()), code);
    EXPECT_EQ(sent.error_message(), "what happened");
    EXPECT_EQ(fixture::InfoOf(sent).reason(), absl::StatusCodeToString(status.code()));
    EXPECT_EQ(fixture::InfoOf(sent).domain(), "vantage");
    google::rpc::Status details;
    ASSERT_TRUE(details.ParseFromString(sent.error_details()));
    EXPECT_EQ(details.code(), code);
    EXPECT_EQ(details.message(), "what happened");
  }
}

TEST(SentStatus, AReasonAndItsMetadataStay) {
  const grpc::Status sent = Sent(contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "MODEL_EMPTY", "no scan", {{"scans", "0"}}));
  EXPECT_EQ(fixture::InfoOf(sent).reason(), "MODEL_EMPTY");
  EXPECT_EQ(fixture::InfoOf(sent).metadata().at("scans"), "0");
}

TEST(SentStatus, DetailsWithoutAReasonAreKeptBesideTheOneTheyGet) {
  absl::Status status = absl::NotFoundError("gone");
  google::rpc::ResourceInfo info;
  info.set_resource_name("sessions/job");
  contract::AddDetail(status, info);
  const grpc::Status sent = Sent(status);
  EXPECT_EQ(fixture::InfoOf(sent).reason(), "NOT_FOUND");
  EXPECT_EQ(DetailOf<google::rpc::ResourceInfo>(sent).resource_name(), "sessions/job");
}

TEST(SentStatus, SaysWhenToRetryWhereWaitingHelpsOnly) {
  const absl::Status full =
      contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "STORE_FULL", "no room");
  for (const absl::Status& lasting :
       {full, absl::ResourceExhaustedError("no reason given"), absl::DataLossError("lost"),
        absl::InternalError("broken"), absl::AbortedError("another was first")}) {
    const fixture::BareAnswer answer = Received(lasting);
    EXPECT_FALSE(SaysWhenToRetry(answer.status)) << lasting;
    EXPECT_EQ(Pushback(answer), "") << lasting;
  }
}

TEST(SentStatus, ADelayIsToldToProgramsAndToGrpcItself) {
  const fixture::BareAnswer busy = Received(contract::Retryable(
      absl::StatusCode::kResourceExhausted, "SERVER_BUSY", "busy", absl::Milliseconds(2250)));
  const auto delay = DetailOf<google::rpc::RetryInfo>(busy.status).retry_delay();
  EXPECT_EQ(delay.seconds(), 2);
  EXPECT_EQ(delay.nanos(), 250'000'000);
  EXPECT_EQ(Pushback(busy), "2250");
  EXPECT_EQ(fixture::InfoOf(busy.status).reason(), "SERVER_BUSY");
}

TEST(SentStatus, UnavailableMayBeTriedAgainInASecond) {
  const fixture::BareAnswer down = Received(absl::UnavailableError("the medium fails"));
  EXPECT_EQ(DetailOf<google::rpc::RetryInfo>(down.status).retry_delay().seconds(), 1);
  EXPECT_EQ(Pushback(down), "1000");
}

// A trailer holds 8 KiB; what does not fit would end the call without any reason.
TEST(SentStatus, WhateverIsInItItGetsThrough) {
  // Not ASCII: three bytes for each of them on the wire.
  std::string message;
  while (message.size() < 20'000) message += "\u00dc";
  absl::Status status =
      contract::ErrorWithReason(absl::StatusCode::kFailedPrecondition, "TOO_MUCH_TO_SAY", message);
  for (int i = 0; i < 40; ++i) {
    status.SetPayload(absl::StrCat("type.googleapis.com/some.Detail", i),
                      absl::Cord(std::string(400, 'x')));
  }
  const fixture::BareAnswer answer = Received(status);
  EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::FAILED_PRECONDITION)
      << answer.status.error_message().substr(0, 100);
  EXPECT_LE(answer.status.error_message().size(), 1500U);
  EXPECT_EQ(message.find(answer.status.error_message()), 0U);
  EXPECT_LE(answer.status.error_details().size(), 6144U);
  EXPECT_GT(answer.status.error_details().size(), 4096U);
}

// Half a character is no text: who reads the details would get none of them.
TEST(SentStatus, NoTextEndsWithinACharacter) {
  for (size_t before = 0; before < 4; ++before) {
    std::string text(before, 'x');
    while (text.size() < 2000) text += "\u20ac";  // three bytes
    const auto whole = [&](std::string cut) {
      if (absl::EndsWith(cut, "...")) cut.resize(cut.size() - 3);
      return cut.size() > 100 && text.find(cut) == 0 && (cut.size() - before) % 3 == 0;
    };
    const grpc::Status sent = Sent(absl::FailedPreconditionError(text));
    EXPECT_TRUE(whole(sent.error_message())) << sent.error_message();
    EXPECT_EQ(fixture::InfoOf(sent).reason(), "FAILED_PRECONDITION");

    const std::vector<std::string> fields =
        fixture::ViolatedFields(Sent(contract::InvalidField(text, text)));
    ASSERT_EQ(fields.size(), 1U);
    EXPECT_TRUE(whole(fields[0])) << fields[0];

    const auto metadata =
        fixture::InfoOf(Sent(contract::ErrorWithReason(absl::StatusCode::kAborted, "ABORTED", "",
                                                       {{"name", text}})))
            .metadata();
    ASSERT_EQ(metadata.count("name"), 1U);
    EXPECT_TRUE(whole(metadata.at("name"))) << metadata.at("name");

    const grpc::Status gone = Sent(contract::ResourceNotFound("vantage/Session", text));
    EXPECT_TRUE(whole(DetailOf<google::rpc::ResourceInfo>(gone).resource_name()));
  }
}

grpc::Status AddScannerTo(fixture::InProcess& server, const std::string& session,
                          const std::string& id) {
  grpc::ClientContext context;
  v1::CreateScannerRequest request;
  request.set_parent(session);
  request.set_scanner_id(id);
  request.mutable_scanner();
  v1::CreateScannerResponse response;
  return server.fleet->CreateScanner(&context, request, &response);
}

// Of a place that far along, m.
grpc::Status ClaimBy(fixture::InProcess& server, const std::string& session,
                     const std::string& scanner, double x) {
  grpc::ClientContext context;
  v1::ClaimViewRequest request;
  request.set_parent(session);
  request.set_scanner(session + "/scanners/" + scanner);
  request.mutable_position()->set_x(x);
  v1::ClaimViewResponse response;
  return server.fleet->ClaimView(&context, request, &response);
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
    options.limits.pieces_per_upload = 1;
    return options;
  }
  grpc::Status AddScanner(const std::string& session, const std::string& id) {
    return AddScannerTo(server_, session, id);
  }
  grpc::Status Claim(const std::string& session, double x) {
    return ClaimBy(server_, session, "red", x);
  }
  std::string BeginUpload(const std::string& session) {
    grpc::ClientContext context;
    v1::CreateUploadRequest request;
    request.set_parent(session);
    v1::CreateUploadResponse response;
    EXPECT_TRUE(server_.scans->CreateUpload(&context, request, &response).ok());
    return response.upload().name();
  }
  // The nth piece of an upload whose pieces are all as long as "first".
  grpc::Status SendPiece(const std::string& upload, int n, const std::string& data) {
    v1::UploadPieceRequest request;
    request.set_upload(upload);
    request.mutable_piece()->set_sequence(n);
    request.mutable_piece()->set_offset(5 * n);
    request.mutable_piece()->set_data(data);
    request.mutable_piece()->set_crc32c(bytes::Crc32c(data));
    grpc::ClientContext context;
    v1::UploadPieceResponse response;
    return server_.scans->UploadPiece(&context, request, &response);
  }
  static void ExpectLasting(const grpc::Status& status, const std::string& reason) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << reason;
    EXPECT_EQ(fixture::InfoOf(status).reason(), reason);
    EXPECT_FALSE(SaysWhenToRetry(status)) << reason;
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make(), One()};
};

TEST_F(Limits, OfSessionsLasts) {
  server_.OpenSession("job");
  grpc::ClientContext context;
  v1::CreateSessionResponse response;
  ExpectLasting(server_.sessions->CreateSession(&context, {}, &response), "TOO_MANY_SESSIONS");
}

TEST_F(Limits, OfScansLasts) {
  const std::string session = server_.OpenRoom("job");
  grpc::ClientContext context;
  v1::CreateUploadRequest request;
  request.set_parent(session);
  v1::CreateUploadResponse response;
  ExpectLasting(server_.scans->CreateUpload(&context, request, &response), "TOO_MANY_SCANS");
}

TEST_F(Limits, OfScannersLasts) {
  const std::string session = server_.OpenSession("job");
  EXPECT_TRUE(AddScanner(session, "red").ok());
  ExpectLasting(AddScanner(session, "blue"), "TOO_MANY_SCANNERS");
}

TEST_F(Limits, OfClaimsLasts) {
  const std::string session = server_.OpenSession("job");
  EXPECT_TRUE(AddScanner(session, "red").ok());
  EXPECT_TRUE(Claim(session, 0).ok());
  ExpectLasting(Claim(session, 5), "CLAIMS_FULL");
}

TEST_F(Limits, OfPlansLasts) {
  script_.EndPlans();
  const std::string session = server_.OpenRoom("job");
  const auto plan = [&] {
    grpc::ClientContext context;
    v1::CreatePlanRequest request;
    request.set_parent(session);
    v1::CreatePlanResponse response;
    return server_.plans->CreatePlan(&context, request, &response);
  };
  EXPECT_TRUE(plan().ok());
  ExpectLasting(plan(), "PLANS_FULL");
}

TEST_F(Limits, OfPiecesLasts) {
  const std::string session = server_.OpenSession("job");
  const std::string upload = BeginUpload(session);
  EXPECT_TRUE(SendPiece(upload, 0, "first").ok());
  ExpectLasting(SendPiece(upload, 1, "second"), "TOO_MANY_PIECES");
}

// One scanner's claims, however many all of them may have.
TEST(ClaimsOfAScanner, LimitLasts) {
  fixture::Script script;
  fixture::InProcess server(script.Make());
  const std::string session = server.OpenSession("job");
  EXPECT_TRUE(AddScannerTo(server, session, "red").ok());
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(ClaimBy(server, session, "red", 5 * i).ok()) << i;
  const grpc::Status ninth = ClaimBy(server, session, "red", 40);
  EXPECT_EQ(fixture::InfoOf(ninth).reason(), "TOO_MANY_CLAIMS");
  EXPECT_EQ(ninth.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_FALSE(SaysWhenToRetry(ninth));
}

TEST(FullStore, Lasts) {
  fixture::Script script;
  fixture::GivenStore given;
  given.bytes = 5000;
  fixture::InProcess server(script.Make(), {}, given);
  const std::string session = server.OpenSession("job");
  grpc::Status status;
  for (int i = 0; i < 60 && status.ok(); ++i) {
    status = AddScannerTo(server, session, absl::StrCat("scanner-of-somebody-", i));
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "STORE_FULL");
  EXPECT_FALSE(SaysWhenToRetry(status));
}

// Ten thousand refused places: as an older server left them.
TEST(RefusedPlaces, LimitLasts) {
  fixture::Script script;
  fixture::GivenStore given;
  {
    fixture::InProcess before(script.Make());
    before.OpenSession("job");
    given.logs["job"] = before.store().Read("job", 0, 100).value();
  }
  std::vector<storage::v1::LogEntry>& log = given.logs["job"];
  for (int i = 1; i <= 10'000; ++i) {
    storage::v1::LogEntry entry = log.front();
    entry.clear_request();
    v1::SessionEvent& event = *entry.mutable_event();
    event.set_sequence(log.back().event().sequence() + 1);
    v1::Rejection& rejection = *event.mutable_view_rejected()->mutable_rejection();
    rejection.set_name(absl::StrCat("sessions/job/rejections/rejection-", i));
    rejection.set_radius_m(0.5);
    *rejection.mutable_create_time() = event.time();
    log.push_back(entry);
  }
  fixture::InProcess server(script.Make(), {}, given);
  grpc::ClientContext context;
  v1::RejectViewRequest request;
  request.set_parent("sessions/job");
  request.mutable_position()->set_x(1);
  v1::RejectViewResponse response;
  const grpc::Status status = server.plans->RejectView(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "TOO_MANY_REJECTIONS");
  EXPECT_FALSE(SaysWhenToRetry(status));
}

TEST(Quota, Lasts) {
  fixture::Script script;
  server::ServerOptions options;
  options.limits.tenant_bytes = 1000;
  fixture::InProcess server(script.Make(), options);
  v1::CreateUploadRequest request;
  request.set_parent(server.OpenSession("job"));
  request.mutable_upload()->mutable_total()->set_encoded_size_bytes(1001);
  request.mutable_upload()->mutable_total()->set_sha256(std::string(32, 's'));
  grpc::ClientContext context;
  v1::CreateUploadResponse response;
  const grpc::Status status = server.scans->CreateUpload(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "QUOTA_EXCEEDED");
  EXPECT_FALSE(SaysWhenToRetry(status));
}

}  // namespace
}  // namespace vantage::rpc
