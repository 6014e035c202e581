#include "server/web/connect/call_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/services.h"
#include "server/web/connect/envelope.h"
#include "server/web/connect/transcoding.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::web {
namespace {

using ::testing::HasSubstr;

const RpcDirectory& Directory() {
  static const auto& directory = *new RpcDirectory(rpc::Services::Names());
  return directory;
}

Request Post(const std::string& path, const std::string& type,
             const std::vector<Field>& more = {}) {
  Request request;
  request.method = "POST";
  request.target = path;
  request.fields = {{"host", "x"}, {"content-type", type}};
  request.fields.insert(request.fields.end(), more.begin(), more.end());
  return request;
}

constexpr char kGet[] = "/vantage.v1.SessionService/GetSession";
constexpr char kWatch[] = "/vantage.v1.SessionService/WatchSession";

std::variant<CallRequest, Response> ReadPost(const std::string& path, const std::string& type,
                                             const std::vector<Field>& more = {}) {
  return ReadCall(*Directory().Find(path), Post(path, type, more));
}

// The answer that says why there is no call.
Response Refused(const std::string& path, const std::string& type,
                 const std::vector<Field>& more = {}) {
  const auto read = ReadPost(path, type, more);
  EXPECT_TRUE(std::holds_alternative<Response>(read)) << path << " " << type;
  return std::holds_alternative<Response>(read) ? std::get<Response>(read) : Response();
}

std::string FieldOf(const Response& response, const std::string& name) {
  for (const Field& field : response.fields) {
    if (field.name == name) return field.value;
  }
  return "";
}

TEST(CallRequest, KnowsTheRpcsByTheirPathsAndNoOthers) {
  EXPECT_EQ(Directory().Find(kGet)->full_name(), "vantage.v1.SessionService.GetSession");
  for (const char* none :
       {"", "/", "/vantage.v1.SessionService", "/vantage.v1.SessionService/",
        "/vantage.v1.SessionService/getSession", "//vantage.v1.SessionService/GetSession",
        "/grpc.health.v1.Health/Check", "/vantage.v1.SessionService/GetSession/"}) {
    EXPECT_EQ(Directory().Find(none), nullptr) << none;
  }
}

TEST(CallRequest, TheContentTypeSaysHowMessagesAreWritten) {
  const auto json = std::get<CallRequest>(ReadPost(kGet, "application/json; charset=utf-8"));
  EXPECT_TRUE(json.json);
  EXPECT_FALSE(json.stream);
  EXPECT_EQ(json.path(), kGet);
  EXPECT_FALSE(std::get<CallRequest>(ReadPost(kGet, "Application/Proto")).json);
  EXPECT_TRUE(std::get<CallRequest>(ReadPost(kWatch, "application/connect+json")).json);
  const auto stream = std::get<CallRequest>(ReadPost(kWatch, "application/connect+proto"));
  EXPECT_TRUE(stream.stream);
  EXPECT_FALSE(stream.json);
  EXPECT_FALSE(stream.timeout.has_value());
}

TEST(CallRequest, OtherTypesAreRefusedAndThoseThatDoAreNamed) {
  for (const char* type : {"", "text/plain", "application/grpc", "application/grpc-web+proto",
                           "application/connect+json", "application/jsonx"}) {
    const Response refused = Refused(kGet, type);
    EXPECT_EQ(refused.status, 415) << type;
    EXPECT_EQ(FieldOf(refused, "accept-post"), "application/proto, application/json");
  }
  EXPECT_EQ(Refused(kWatch, "application/json").status, 415);
}

TEST(CallRequest, OnlyPostCalls) {
  for (const char* method : {"GET", "HEAD", "PUT", "DELETE", "OPTIONS", "post"}) {
    Request request = Post(kGet, "application/json");
    request.method = method;
    const auto read = ReadCall(*Directory().Find(kGet), request);
    ASSERT_TRUE(std::holds_alternative<Response>(read));
    EXPECT_EQ(std::get<Response>(read).status, 405);
    EXPECT_EQ(FieldOf(std::get<Response>(read), "allow"), "POST");
  }
}

TEST(CallRequest, TimeoutsAreNumbersOfAtMostTenDigits) {
  const auto given = [](const char* text) {
    return ReadPost(kGet, "application/json", {{"connect-timeout-ms", text}});
  };
  EXPECT_EQ(std::get<CallRequest>(given("0")).timeout, std::chrono::milliseconds(0));
  EXPECT_EQ(std::get<CallRequest>(given("1500")).timeout, std::chrono::milliseconds(1500));
  EXPECT_EQ(std::get<CallRequest>(given("9999999999")).timeout->count(), 9'999'999'999);
  for (const char* wrong : {"", "-1", "+1", "1.5", " 1", "1s", "12345678901", "0x10"}) {
    const auto read = given(wrong);
    ASSERT_TRUE(std::holds_alternative<Response>(read)) << wrong;
    EXPECT_EQ(std::get<Response>(read).status, 400) << wrong;
    EXPECT_THAT(*std::get<Response>(read).body, HasSubstr("\"invalid_argument\""));
  }
}

TEST(CallRequest, AnotherVersionOrCompressionIsRefusedAsTheProtocolSays) {
  EXPECT_TRUE(std::holds_alternative<CallRequest>(
      ReadPost(kGet, "application/json", {{"connect-protocol-version", "1"}})));
  EXPECT_EQ(Refused(kGet, "application/json", {{"connect-protocol-version", "2"}}).status, 400);
  const Response packed = Refused(kGet, "application/json", {{"content-encoding", "gzip"}});
  EXPECT_EQ(packed.status, 501);
  EXPECT_THAT(*packed.body, HasSubstr("identity"));
  // Of a stream the errors are in its last message.
  const Response stream =
      Refused(kWatch, "application/connect+json", {{"connect-content-encoding", "gzip"}});
  EXPECT_EQ(stream.status, 200);
  EXPECT_EQ(FieldOf(stream, "content-type"), "application/connect+json");
  ASSERT_GT(stream.body->size(), kEnvelopeBytes);
  EXPECT_EQ((*stream.body)[0], kEndOfStreamFlag);
  EXPECT_THAT(*stream.body, HasSubstr("\"unimplemented\""));
}

TEST(CallRequest, WhatStreamsBothWaysIsRefusedInWords) {
  const Response refused =
      Refused("/vantage.v1.ScanService/UploadScan", "application/connect+proto");
  EXPECT_EQ(refused.status, 200);
  EXPECT_THAT(*refused.body, HasSubstr("\"unimplemented\""));
}

TEST(CallRequest, MessagesInJsonAreThoseInBinary) {
  CallRequest call;
  call.method = Directory().Find(kGet);
  v1::GetSessionRequest request;
  request.set_name("sessions/x");
  EXPECT_EQ(*ReadMessage(call, request.SerializeAsString()), request.SerializeAsString());
  call.json = true;
  EXPECT_EQ(*ReadMessage(call, R"({"name": "sessions/x"})"), request.SerializeAsString());
  EXPECT_EQ(*ReadMessage(call, "{}"), "");
  for (const char* wrong : {"", "[]", "{", R"({"nam": "misspelt"})", R"({"name": 1})",
                            R"({"name": "a"} {})", "null garbage"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ReadMessage(call, wrong).status())) << wrong;
  }
  call.stream = true;
  EXPECT_EQ(*ReadMessage(call, Enveloped(0, R"({"name": "sessions/x"})")),
            request.SerializeAsString());
}

TEST(CallRequest, JsonThatNestsWithoutEndIsRefused) {
  const auto& type = *v1::CreateSessionRequest::descriptor();
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += R"({"session":)";
  EXPECT_FALSE(BinaryOf(type, deep).ok());
  EXPECT_FALSE(BinaryOf(type, std::string(1'000'000, '[')).ok());
}

TEST(CallRequest, BytesSurviveJson) {
  v1::UploadPieceRequest piece;
  piece.set_upload("sessions/a/uploads/b");
  piece.mutable_piece()->set_offset(int64_t{1} << 60);
  piece.mutable_piece()->set_data(std::string("\0\xff\x80", 3));
  const auto& type = *v1::UploadPieceRequest::descriptor();
  const absl::StatusOr<std::string> json = JsonOf(type, piece.SerializeAsString());
  ASSERT_TRUE(json.ok());
  EXPECT_THAT(*json, HasSubstr("\"1152921504606846976\""));
  EXPECT_EQ(*BinaryOf(type, *json), piece.SerializeAsString());
}

TEST(CallRequest, AnAnswerHasTheTypeOfItsRequestAndAnErrorIsInJson) {
  CallRequest call;
  call.method = Directory().Find(kGet);
  v1::GetSessionResponse message;
  message.mutable_session()->set_name("sessions/x");
  const absl::StatusOr<Response> binary = UnaryAnswer(call, message.SerializeAsString());
  ASSERT_TRUE(binary.ok());
  EXPECT_EQ(FieldOf(*binary, "content-type"), "application/proto");
  EXPECT_EQ(*binary->body, message.SerializeAsString());
  const Response error = ErrorAnswer(call, {grpc::StatusCode::NOT_FOUND, "none"});
  EXPECT_EQ(error.status, 404);
  EXPECT_EQ(FieldOf(error, "content-type"), "application/json");
  call.json = true;
  EXPECT_EQ(*UnaryAnswer(call, message.SerializeAsString())->body,
            R"({"session":{"name":"sessions/x"}})");
}

}  // namespace
}  // namespace vantage::web
