// The web listener over real connections: in front of a whole server, where what it says is held
// against what the same server says over gRPC, and in front of a bare one.
#include "server/web/gateway.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <future>
#include <set>
#include <thread>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "google/protobuf/util/json_util.h"
#include "google/rpc/status.pb.h"
#include "server/rpc/services.h"
#include "server/web/connect/error.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/web_client.h"
#include "tests/server/web/endless_server.h"

namespace vantage::web {
namespace {

using fixture::WebAnswer;
using fixture::WebClient;
using fixture::WebMessage;
using fixture::WebRequest;
using google::protobuf::MethodDescriptor;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Fields = std::vector<std::pair<std::string, std::string>>;
const Fields kJson = {{"content-type", "application/json"}};
const Fields kProto = {{"content-type", "application/proto"}};
const Fields kJsonStream = {{"content-type", "application/connect+json"}};

std::vector<const MethodDescriptor*> AllRpcs() {
  std::vector<const MethodDescriptor*> methods;
  for (const std::string& name : rpc::Services::Names()) {
    const auto* service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; i < service->method_count(); ++i) methods.push_back(service->method(i));
  }
  return methods;
}

std::string PathOf(const MethodDescriptor& method) {
  return absl::StrCat("/", method.service()->full_name(), "/", method.name());
}

std::string InEnvelope(const std::string& message) {
  std::string head(5, '\0');
  for (int i = 0; i < 4; ++i)
    head[static_cast<size_t>(4 - i)] = static_cast<char>(message.size() >> 8 * i);
  return head + message;
}

// What a unary call over gRPC ends with, in the form that the web has it in.
grpc::Status OverGrpc(fixture::InProcess& host, const std::string& path,
                      const std::string& message) {
  const grpc::Slice slice(message);
  grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::ClientContext context;
  std::promise<grpc::Status> done;
  grpc::GenericStub(host.channel())
      .UnaryCall(&context, path, {}, &request, &response,
                 [&](grpc::Status status) { done.set_value(std::move(status)); });
  return done.get_future().get();
}

// Details of an error come in any order.
nlohmann::json Sorted(const std::string& text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  nlohmann::json& details = json.contains("error") ? json["error"]["details"] : json["details"];
  if (details.is_array()) std::sort(details.begin(), details.end());
  return json;
}

server::ServerOptions WithWeb() {
  server::ServerOptions options;
  options.web_listen = "127.0.0.1:0";
  options.heartbeat = std::chrono::milliseconds(20);
  return options;
}

class GatewayTest : public ::testing::Test {
 protected:
  explicit GatewayTest(const server::ServerOptions& options = WithWeb()) {
    script_.EndPlans();
    host_ = std::make_unique<fixture::InProcess>(script_.Make(), options);
  }
  int port() const { return host_->server().web_port(); }
  WebAnswer Call(const std::string& path, const std::string& json) const {
    return WebClient(port()).Ask("POST", path, kJson, json);
  }

  fixture::Script script_;
  std::unique_ptr<fixture::InProcess> host_;
};

constexpr char kGetSession[] = "/vantage.v1.SessionService/GetSession";
constexpr char kListSessions[] = "/vantage.v1.SessionService/ListSessions";
constexpr char kWatchSession[] = "/vantage.v1.SessionService/WatchSession";

TEST_F(GatewayTest, EveryRpcIsThereAndFailsAsOverGrpc) {
  int unary = 0;
  int streams = 0;
  WebClient client(port());
  for (const MethodDescriptor* method : AllRpcs()) {
    const std::string path = PathOf(*method);
    if (method->client_streaming()) continue;
    // An empty request lacks what it has to say, but for two.
    const grpc::Status expected = OverGrpc(*host_, path, "");
    if (method->server_streaming()) {
      ++streams;
      const WebAnswer answer = client.Ask("POST", path, kJsonStream, InEnvelope("{}"));
      EXPECT_EQ(answer.status, 200) << path;
      ASSERT_GT(answer.body.size(), 5) << path;
      EXPECT_EQ(answer.body[0], 2) << path;
      EXPECT_EQ(Sorted(answer.body.substr(5)), Sorted(EndOfStreamJson(expected))) << path;
      continue;
    }
    ++unary;
    const WebAnswer answer = client.Ask("POST", path, kProto, "");
    if (expected.ok()) {
      EXPECT_EQ(answer.status, 200) << path;
      continue;
    }
    EXPECT_EQ(answer.status, HttpStatusOf(expected.error_code())) << path;
    EXPECT_EQ(Sorted(answer.body), Sorted(ErrorJson(expected))) << path;
  }
  EXPECT_GT(unary, 35);
  EXPECT_EQ(streams, 5);
}

TEST_F(GatewayTest, AnswersAreThoseOfGrpcInBinaryAndInJson) {
  host_->OpenSession("flat");
  v1::GetSessionRequest request;
  request.set_name("sessions/flat");
  v1::GetSessionResponse expected;
  grpc::ClientContext context;
  ASSERT_TRUE(host_->sessions->GetSession(&context, request, &expected).ok());
  WebClient client(port());
  const WebAnswer binary = client.Ask("POST", kGetSession, kProto, request.SerializeAsString());
  v1::GetSessionResponse read;
  ASSERT_TRUE(read.ParseFromString(binary.body));
  EXPECT_EQ(read.SerializeAsString(), expected.SerializeAsString());
  EXPECT_EQ(binary.Field("content-type"), "application/proto");
  const WebAnswer json = client.Ask("POST", kGetSession, kJson, R"({"name":"sessions/flat"})");
  v1::GetSessionResponse in_words;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json.body, &in_words).ok()) << json.body;
  EXPECT_EQ(in_words.SerializeAsString(), expected.SerializeAsString());
}

TEST_F(GatewayTest, NothingOfGrpcsOwnHeadersIsPassedOn) {
  const WebAnswer answer = Call(kGetSession, R"({"name":"sessions/none"})");
  EXPECT_EQ(answer.status, 404);
  std::set<std::string> names;
  for (const auto& [name, value] : answer.fields) names.insert(name);
  EXPECT_EQ(names, (std::set<std::string>{"date", "content-type", "cache-control",
                                          "x-content-type-options", "content-length"}));
}

TEST_F(GatewayTest, AStreamTellsEventsAndSpeaksWhileThereAreNone) {
  host_->OpenSession("flat");
  WebClient client(port());
  client.Send(
      WebRequest("POST", kWatchSession, kJsonStream, InEnvelope(R"({"name":"sessions/flat"})")));
  const WebAnswer head = client.ReadHead();
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.Field("content-type"), "application/connect+json");
  WebMessage message = client.ReadMessage();
  EXPECT_EQ(message.flags, 0);
  EXPECT_THAT(message.data, HasSubstr("sessionCreated"));
  message = client.ReadMessage();
  EXPECT_THAT(message.data, HasSubstr("heartbeat"));
  host_->Drain();
  std::string last;
  while (message.flags == 0) {
    last = message.data;
    message = client.ReadMessage();
  }
  EXPECT_THAT(last, HasSubstr("resume"));
  EXPECT_EQ(message.flags, 2);
  EXPECT_THAT(message.data, HasSubstr("\"unavailable\""));
  EXPECT_THAT(message.data, HasSubstr("DRAINING"));
  EXPECT_TRUE(client.ReadEnd());
}

// Two megabytes of empty messages take a quarter of a second to read, and are refused for their
// end. Two who send them would take both threads; so calls beside them were as few as those.
TEST_F(GatewayTest, LargeJsonDoesNotHoldUpCalls) {
  std::string json = R"({"session":{"scannerModels":[{})";
  for (int i = 0; i < 600'000; ++i) json += ",{}";
  json += "}";
  std::atomic<int> left = 2;
  std::vector<std::thread> senders;
  for (int i = left; i > 0; --i) {
    senders.emplace_back([&] {
      WebClient client(port());
      for (int again = 0; again < 3; ++again) {
        const WebAnswer answer =
            client.Ask("POST", "/vantage.v1.SessionService/CreateSession", kJson, json);
        EXPECT_EQ(answer.status, 400);
        EXPECT_THAT(answer.body, HasSubstr("no CreateSessionRequest in JSON"));
      }
      --left;
    });
  }
  int calls = 0;
  for (WebClient client(port()); left > 0; ++calls) {
    // A fast machine asks more often than a caller may.
    EXPECT_THAT(client.Ask("POST", kListSessions, kJson, "{}").status, AnyOf(200, 429));
  }
  for (std::thread& sender : senders) sender.join();
  EXPECT_GT(calls, 600);  // some 3,500, and else 50 to 210
}

TEST_F(GatewayTest, ATimeoutIsTheCallsDeadline) {
  const WebAnswer late = WebClient(port()).Ask(
      "POST", kListSessions, {{"content-type", "application/json"}, {"connect-timeout-ms", "0"}},
      "{}");
  EXPECT_EQ(late.status, 504);
  EXPECT_THAT(late.body, HasSubstr("\"deadline_exceeded\""));
  host_->OpenSession("flat");
  Fields fields = kJsonStream;
  fields.emplace_back("connect-timeout-ms", "100");
  const WebAnswer stream = WebClient(port()).Ask("POST", kWatchSession, fields,
                                                 InEnvelope(R"({"name":"sessions/flat"})"));
  EXPECT_TRUE(stream.whole);
  EXPECT_THAT(stream.body, HasSubstr("\"deadline_exceeded\""));
}

TEST_F(GatewayTest, OneConnectionTakesManyRequestsAlsoSentAhead) {
  WebClient client(port());
  const std::string one = WebRequest("POST", kListSessions, kJson, "{}");
  std::string all;
  for (int i = 0; i < 50; ++i) all += one + WebRequest("GET", "/none");
  client.Send(all);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(client.Read().status, 200) << i;
    EXPECT_EQ(client.Read().status, 404) << i;
  }
}

TEST_F(GatewayTest, BodiesComeInChunksOrAfterBeingAskedFor) {
  WebClient client(port());
  client.Send(absl::StrCat("POST ", kListSessions,
                           " HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: application/json\r\n"
                           "transfer-encoding: chunked\r\n\r\n1\r\n{\r\n1\r\n}\r\n0\r\n\r\n"));
  EXPECT_EQ(client.Read().status, 200);
  client.Send(absl::StrCat("POST ", kListSessions,
                           " HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: application/json\r\n"
                           "expect: 100-continue\r\ncontent-length: 2\r\n\r\n"));
  EXPECT_EQ(client.Read().status, 100);
  client.Send("{}");
  EXPECT_EQ(client.Read().status, 200);
}

TEST_F(GatewayTest, AClientOfHttp10GetsItsAnswerAndNoStream) {
  WebClient client(port());
  client.Send(absl::StrCat("POST ", kListSessions,
                           " HTTP/1.0\r\nhost: 127.0.0.1\r\ncontent-type: application/json\r\n"
                           "content-length: 2\r\n\r\n{}"));
  EXPECT_EQ(client.Read().status, 200);
  EXPECT_TRUE(client.ReadEnd());
  WebClient stream(port());
  stream.Send(absl::StrCat("POST ", kWatchSession,
                           " HTTP/1.0\r\nhost: 127.0.0.1\r\n"
                           "content-type: application/connect+json\r\n\r\n"));
  EXPECT_EQ(stream.Read().status, 505);
}

TEST_F(GatewayTest, WhatIsTooLargeIsRefusedBeforeItCame) {
  for (const Fields& fields : {kJson, kProto, kJsonStream}) {
    WebClient client(port());
    std::string request =
        absl::StrCat("POST ", fields == kJsonStream ? kWatchSession : kListSessions,
                     " HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: ", fields[0].second,
                     "\r\ncontent-length: 100000000\r\n\r\n");
    client.Send(request);
    const WebAnswer refused = client.Read();
    EXPECT_EQ(refused.status, fields == kJsonStream ? 200 : 429);
    EXPECT_THAT(refused.body, HasSubstr("\"resource_exhausted\""));
    EXPECT_EQ(refused.Field("connection"), "close");
    EXPECT_TRUE(client.ReadEnd());
  }
  // Of one that does not say how much comes, no more than is allowed is taken.
  WebClient endless(port());
  endless.Send(absl::StrCat("POST ", kListSessions,
                            " HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: application/proto\r\n"
                            "transfer-encoding: chunked\r\n\r\n"));
  const std::string chunk = absl::StrCat("10000\r\n", std::string(1 << 16, 'x'), "\r\n");
  for (int i = 0; i < 70; ++i) endless.Send(chunk);
  EXPECT_EQ(endless.Read().status, 429);
}

TEST_F(GatewayTest, WhatIsNoRequestEndsItsConnectionAlone) {
  for (const char* wrong : {"hello\r\n\r\n", "\x16\x03\x01", "GET / HTTP/1.1\r\n\r\n",
                            "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
                            "POST / HTTP/1.1\r\nhost: x\r\ntransfer-encoding: gzip\r\n\r\n"}) {
    WebClient client(port());
    client.Send(absl::StrCat(wrong, std::string(100, '\n')));
    const WebAnswer answer = client.Read();
    EXPECT_TRUE(answer.status == 400 || answer.status == 501 || answer.status == 421) << wrong;
    EXPECT_TRUE(client.ReadEnd()) << wrong;
  }
  EXPECT_EQ(Call(kListSessions, "{}").status, 200);
}

TEST_F(GatewayTest, AnUploadGoesByItsUnaryTwin) {
  host_->OpenSession("flat");
  const WebAnswer created =
      Call("/vantage.v1.ScanService/CreateUpload", R"({"parent":"sessions/flat"})");
  ASSERT_EQ(created.status, 200) << created.body;
  v1::CreateUploadResponse upload;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(created.body, &upload).ok());
  v1::UploadPieceRequest piece;
  piece.set_upload(upload.upload().name());
  piece.mutable_piece()->set_data(std::string(256 << 10, 'x'));
  const WebAnswer taken = WebClient(port()).Ask("POST", "/vantage.v1.ScanService/UploadPiece",
                                                kProto, piece.SerializeAsString());
  // As it is no scan's beginning; the piece itself came through whole.
  const grpc::Status expected =
      OverGrpc(*host_, "/vantage.v1.ScanService/UploadPiece", piece.SerializeAsString());
  EXPECT_EQ(taken.status, expected.ok() ? 200 : HttpStatusOf(expected.error_code()));
}

server::ServerOptions WithFewCalls() {
  server::ServerOptions options = WithWeb();
  options.limits.calls = 4;  // three of them streams
  return options;
}

class CrowdedGatewayTest : public GatewayTest {
 protected:
  CrowdedGatewayTest() : GatewayTest(WithFewCalls()) { host_->OpenSession("flat"); }
  std::unique_ptr<WebClient> Watch() const {
    auto client = std::make_unique<WebClient>(port());
    client->Send(
        WebRequest("POST", kWatchSession, kJsonStream, InEnvelope(R"({"name":"sessions/flat"})")));
    client->ReadHead();
    return client;
  }
};

TEST_F(CrowdedGatewayTest, CallsByTheWebCountAmongAllAndOneWhoseClientLeftIsOver) {
  std::vector<std::unique_ptr<WebClient>> watching;
  for (int i = 0; i < 3; ++i) {
    watching.push_back(Watch());
    EXPECT_EQ(watching.back()->ReadMessage().flags, 0);
  }
  const WebMessage refused = Watch()->ReadMessage();
  EXPECT_EQ(refused.flags, 2);
  EXPECT_THAT(refused.data, HasSubstr("SERVER_BUSY"));
  // Over gRPC it is the same count.
  grpc::ClientContext context;
  v1::WatchSessionRequest request;
  request.set_name("sessions/flat");
  v1::WatchSessionResponse message;
  const auto reader = host_->sessions->WatchSession(&context, request);
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  // Nothing but the end of its connection tells that a client has left.
  watching.front()->Close();
  while (Watch()->ReadMessage().flags != 0) std::this_thread::yield();
}

// A gateway alone, in front of a server that answers without end.
class BareGateway {
 public:
  explicit BareGateway(GatewayOptions options, size_t message_bytes = 64 << 10)
      : server_(message_bytes) {
    options.address = "127.0.0.1:0";
    options.router.services = rpc::Services::Names();
    auto started = Gateway::Start(std::move(options), PageFiles(), server_.channel(),
                                  rpc::WebSeal::New(), nullptr, metrics_);
    EXPECT_TRUE(started.ok()) << started.status();
    gateway_ = *std::move(started);
  }
  int port() const { return gateway_->port(); }
  EndlessServer& server() { return server_; }
  Gateway& gateway() { return *gateway_; }
  std::string metrics() const { return metrics_.Text(); }

 private:
  telemetry::Metrics metrics_;
  EndlessServer server_;
  std::unique_ptr<Gateway> gateway_;
};

TEST(BareGatewayTest, NothingQueuesUpBehindAReaderThatDoesNotRead) {
  GatewayOptions options;
  options.patience.body = std::chrono::milliseconds(300);
  BareGateway bare(options);
  WebClient client(bare.port());
  client.Send(WebRequest("POST", kWatchSession, {{"content-type", "application/connect+proto"}},
                         InEnvelope("")));
  // Until the gateway has had enough of it. Meanwhile it wrote what the two sockets hold.
  bare.server().WaitForEnd();
  EXPECT_LT(bare.server().written() * (64 << 10), 32 << 20);
}

TEST(BareGatewayTest, WhoSaysNothingOrNotEnoughLosesTheConnection) {
  GatewayOptions options;
  options.patience.head = std::chrono::milliseconds(100);
  options.patience.body = std::chrono::milliseconds(100);
  options.patience.idle = std::chrono::milliseconds(100);
  BareGateway bare(options);
  const std::string whole = WebRequest("POST", kListSessions, kJson, std::string(1000, ' '));
  for (const size_t said : {size_t{0}, size_t{5}, whole.size() - 1}) {
    WebClient client(bare.port());
    client.Send(whole.substr(0, said));
    EXPECT_TRUE(client.ReadEnd()) << said;
  }
  WebClient after_an_answer(bare.port());
  EXPECT_EQ(after_an_answer.Ask("GET", "/none").status, 404);
  EXPECT_TRUE(after_an_answer.ReadEnd());
}

TEST(BareGatewayTest, ConnectionsHaveABoundAndPlacesComeBack) {
  GatewayOptions options;
  options.connections = 3;
  BareGateway bare(options);
  std::vector<std::unique_ptr<WebClient>> there;
  for (int i = 0; i < 3; ++i) {
    there.push_back(std::make_unique<WebClient>(bare.port()));
    EXPECT_EQ(there.back()->Ask("GET", "/none").status, 404);
  }
  EXPECT_EQ(WebClient(bare.port()).Ask("GET", "/none").status, 0);
  EXPECT_THAT(bare.metrics(), HasSubstr("vantage_web_connections_refused_total 1"));
  EXPECT_THAT(bare.metrics(), HasSubstr("vantage_web_connections 3"));
  there.pop_back();
  while (WebClient(bare.port()).Ask("GET", "/none").status == 0) std::this_thread::yield();
}

TEST(BareGatewayTest, BodiesOfAllConnectionsHaveABound) {
  GatewayOptions options;
  options.memory_bytes = 100'000;
  BareGateway bare(options);
  const std::string whole = WebRequest("POST", kListSessions, kJson, std::string(60'000, ' '));
  WebClient first(bare.port());
  first.Send(whole.substr(0, whole.size() - 1));
  WebClient second(bare.port());
  second.Send(whole.substr(0, whole.size() - 1));
  // Parts of both may be on their way: whichever brings too much is refused, and the other has
  // room.
  std::array clients = {&first, &second};
  std::array<std::future<WebAnswer>, 2> answers;
  for (size_t i = 0; i < 2; ++i) {
    answers[i] = std::async(std::launch::async, [client = clients[i]] { return client->Read(); });
  }
  size_t refused = 0;
  while (answers[refused].wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
    refused = 1 - refused;
  }
  clients[1 - refused]->Send(whole.substr(whole.size() - 1));
  const WebAnswer one = answers[refused].get();
  EXPECT_EQ(one.status, 429);
  EXPECT_THAT(one.body, HasSubstr("SERVER_BUSY"));
  const WebAnswer other = answers[1 - refused].get();
  EXPECT_NE(other.status, 0);
  EXPECT_NE(other.status, 429);
}

TEST(BareGatewayTest, StoppingEndsStreamsAndRestsAlike) {
  BareGateway bare({}, 100);
  WebClient resting(bare.port());
  EXPECT_EQ(resting.Ask("GET", "/none").status, 404);
  WebClient streaming(bare.port());
  streaming.Send(WebRequest("POST", kWatchSession, {{"content-type", "application/connect+proto"}},
                            InEnvelope("")));
  EXPECT_EQ(streaming.ReadHead().status, 200);
  EXPECT_EQ(streaming.ReadMessage().flags, 0);
  bare.gateway().Stop(std::chrono::milliseconds(50));
  EXPECT_TRUE(resting.ReadEnd());
  EXPECT_TRUE(streaming.ReadEnd());
  EXPECT_FALSE(WebClient(bare.port()).connected());
  bare.server().WaitForEnd();
}

TEST(BareGatewayTest, AddressesThatAreNoneAreRefused) {
  EndlessServer server(1);
  telemetry::Metrics metrics;
  for (const char* wrong : {"", "here", "127.0.0.1", "127.0.0.1:70000", "example.org:80", ":80",
                            "unix:", "127.0.0.1:x"}) {
    GatewayOptions options;
    options.address = wrong;
    EXPECT_TRUE(absl::IsInvalidArgument(
        Gateway::Start(options, PageFiles(), server.channel(), {}, nullptr, metrics).status()))
        << wrong;
  }
  BareGateway bare({});
  GatewayOptions taken;
  taken.address = absl::StrCat("127.0.0.1:", bare.port());
  EXPECT_TRUE(absl::IsUnavailable(
      Gateway::Start(taken, PageFiles(), server.channel(), {}, nullptr, metrics).status()));
}

}  // namespace
}  // namespace vantage::web
