// Who may call by the web: the same callers as over gRPC, with what they show there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/rpc/call/rules.h"
#include "tests/server/fixture/certificates.h"
#include "tests/server/fixture/secured_server.h"
#include "tests/server/fixture/web_client.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::web {
namespace {

using fixture::SecuredServer;
using fixture::WebAnswer;
using fixture::WebClient;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

using FieldList = std::vector<std::pair<std::string, std::string>>;

WebAnswer CallBy(WebClient& client, const std::string& method, const std::string& json,
                 FieldList fields = {}) {
  fields.emplace_back("content-type", "application/json");
  return client.Ask("POST", "/vantage.v1." + method, fields, json);
}

FieldList Showing(const std::string& token) { return {{"authorization", "Bearer " + token}}; }

WebAnswer Open(SecuredServer& secured, const std::string& id, const FieldList& fields) {
  WebClient client(secured.server().web_port());
  return CallBy(client, "SessionService/CreateSession",
                absl::StrCat(R"({"session_id":")", id, R"("})"), fields);
}

server::ServerOptions AlsoByWeb(server::ServerOptions options) {
  options.web_listen = "127.0.0.1:0";
  return options;
}

TEST(SecuredWeb, NoMethodAnswersAStranger) {
  SecuredServer secured;
  secured.AddToken("tablet museum administer");
  secured.Start(AlsoByWeb(secured.WithCallers()));
  for (const rpc::RpcRule& rule : rpc::kRpcRules) {
    if (rule.stream) continue;
    WebClient client(secured.server().web_port());
    const WebAnswer answer = CallBy(
        client, absl::StrCat(std::string(rule.service), "/", std::string(rule.method)), "{}");
    EXPECT_TRUE(answer.status == 401 || answer.status == 429) << rule.method << answer.body;
  }
}

TEST(SecuredWeb, ATokenIsItsCallersWithRolesTenantAndAudit) {
  SecuredServer secured;
  const std::string tablet = secured.AddToken("tablet museum submit,read");
  const std::string other = secured.AddToken("other bridge administer");
  secured.Start(AlsoByWeb(secured.WithCallers()));
  EXPECT_EQ(Open(secured, "flat", Showing(tablet)).status, 200);
  WebClient client(secured.server().web_port());
  const WebAnswer refused = CallBy(client, "SessionService/DeleteSession",
                                   R"({"name":"sessions/flat"})", Showing(tablet));
  EXPECT_EQ(refused.status, 403);
  EXPECT_THAT(refused.body, HasSubstr("ROLE_MISSING"));
  // Another tenant does not see it.
  EXPECT_EQ(
      CallBy(client, "SessionService/DeleteSession", R"({"name":"sessions/flat"})", Showing(other))
          .status,
      404);
  const auto audited = secured.Lines("\"CreateSession\"");
  ASSERT_THAT(audited, SizeIs(1));
  EXPECT_THAT(audited[0], HasSubstr("\"caller\":\"tablet\""));
  EXPECT_THAT(audited[0], HasSubstr("\"tenant\":\"museum\""));
  EXPECT_THAT(audited[0], HasSubstr("\"peer\":\"ipv4:127.0.0.1:"));
  EXPECT_THAT(secured.Lines("\"DeleteSession\""), Not(IsEmpty()));
}

TEST(SecuredWeb, ATokenThatIsTakenBackEndsItsStreams) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum submit,read");
  server::ServerOptions options = AlsoByWeb(secured.WithCallers());
  options.heartbeat = std::chrono::milliseconds(20);
  secured.Start(options);
  ASSERT_EQ(Open(secured, "flat", Showing(token)).status, 200);
  WebClient client(secured.server().web_port());
  const std::string message = R"({"name":"sessions/flat"})";
  client.Send(fixture::WebRequest(
      "POST", "/vantage.v1.SessionService/WatchSession",
      {{"content-type", "application/connect+json"}, {"authorization", "Bearer " + token}},
      std::string("\0\0\0\0", 4) + static_cast<char>(message.size()) + message));
  EXPECT_EQ(client.ReadHead().status, 200);
  EXPECT_EQ(client.ReadMessage().flags, 0);
  secured.WriteCallersBut("tablet");
  secured.server().RefreshCallers();
  fixture::WebMessage last = client.ReadMessage();
  while (last.flags == 0) last = client.ReadMessage();
  EXPECT_THAT(last.data, HasSubstr("CREDENTIALS_WITHDRAWN"));
}

TEST(SecuredWeb, NobodySaysForAnotherWhoCalls) {
  SecuredServer secured;
  secured.AddLine("office museum administer certificate:office.example");
  const std::string token = secured.AddToken("tablet museum submit");
  server::ServerOptions options = AlsoByWeb(secured.WithCallers());
  options.listen = {"127.0.0.1:0"};
  options.access.certificate_metadata = "x-client-certificate";
  options.access.address_metadata = "x-forwarded-for";
  options.web_listen = "unix:" + secured.File("web");
  secured.Start(options);
  const std::string office =
      fixture::DerInBase64(secured.authority().Issue("office.example").certificate);
  // By the socket it is the proxy who says so.
  {
    WebClient proxy(secured.File("web"));
    const WebAnswer answer =
        CallBy(proxy, "SessionService/CreateSession", R"({"session_id":"one"})",
               {{"x-client-certificate", office}, {"x-forwarded-for", "10.1.2.3"}});
    EXPECT_EQ(answer.status, 200) << answer.body;
    const auto audited = secured.Lines("\"CreateSession\"");
    ASSERT_THAT(audited, SizeIs(1));
    EXPECT_THAT(audited[0], HasSubstr("\"caller\":\"office\""));
    EXPECT_THAT(audited[0], HasSubstr("\"peer\":\"ipv4:10.1.2.3\""));
  }
  // What the gateway itself tells the server cannot be told it from outside, neither by the web nor
  // over gRPC.
  const FieldList forged = {{"vantage-web-certificate", office},
                            {"vantage-web-peer", "unix:"},
                            {"vantage-web-seal", std::string(64, '0')}};
  WebClient proxy(secured.File("web"));
  EXPECT_EQ(CallBy(proxy, "SessionService/ListSessions", "{}", forged).status, 401);
  grpc::ClientContext context;
  for (const auto& [name, value] : forged) context.AddMetadata(name, value);
  context.AddMetadata("x-client-certificate", office);
  v1::ListSessionsResponse response;
  EXPECT_EQ(v1::SessionService::NewStub(secured.Plain())
                ->ListSessions(&context, v1::ListSessionsRequest(), &response)
                .error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
}

TEST(SecuredWeb, WhatAProxyWouldSayCountsForNothingFromAPort) {
  SecuredServer secured;
  secured.AddLine("office museum administer certificate:office.example");
  server::ServerOptions options = secured.WithCallers();
  options.web_listen = "127.0.0.1:0";
  options.access.tenant_metadata = "x-tenant";
  secured.Start(options);
  const std::string office =
      fixture::DerInBase64(secured.authority().Issue("office.example").certificate);
  WebClient client(secured.server().web_port());
  EXPECT_EQ(CallBy(client, "SessionService/ListSessions", "{}",
                   {{"x-client-certificate", office}, {"x-tenant", "museum"}})
                .status,
            401);
}

TEST(SecuredWeb, CertificatesOfClientsNameCallers) {
  SecuredServer secured;
  secured.AddLine("office museum administer certificate:office.example");
  const std::string token = secured.AddToken("tablet museum submit");
  server::ServerOptions options = AlsoByWeb(secured.WithCallers());
  secured.Encrypt(options, true);
  options.access.tls_optional_client_certificates = true;
  secured.Start(options);
  const fixture::CertifiedKey office = secured.authority().Issue("office", "DNS:office.example");
  const fixture::CertifiedKey nobody = secured.authority().Issue("nobody");
  const fixture::TestAuthority others("another authority");
  const fixture::CertifiedKey forged = others.Issue("office", "DNS:office.example");
  const int port = secured.server().web_port();
  const auto status = [&](const fixture::CertifiedKey& own, const FieldList& fields = {}) {
    WebClient client(port, &secured.authority(), own);
    return CallBy(client, "SessionService/CreateSession", "{}", fields).status;
  };
  EXPECT_EQ(status(office), 200);
  EXPECT_THAT(secured.Lines("\"caller\":\"office\""), SizeIs(1));
  EXPECT_EQ(status(nobody), 401);
  EXPECT_EQ(status({}), 401);
  EXPECT_EQ(status({}, Showing(token)), 200);
  // One that the authority did not sign gets no further than the handshake.
  EXPECT_EQ(status(forged, Showing(token)), 0);
  // Nor does who does not encrypt.
  WebClient plain(port);
  EXPECT_EQ(CallBy(plain, "SessionService/ListSessions", "{}").status, 0);
}

TEST(SecuredWeb, WhereCertificatesAreRequiredNobodyGetsFurtherWithout) {
  SecuredServer secured;
  server::ServerOptions options;
  options.web_listen = "127.0.0.1:0";
  secured.Encrypt(options, true);
  secured.Start(options);
  const fixture::CertifiedKey office = secured.authority().Issue("office");
  WebClient known(secured.server().web_port(), &secured.authority(), office);
  EXPECT_EQ(CallBy(known, "SessionService/CreateSession", "{}").status, 200);
  EXPECT_THAT(secured.Lines("\"caller\":\"office\""), SizeIs(1));
  WebClient unknown(secured.server().web_port(), &secured.authority());
  EXPECT_EQ(CallBy(unknown, "SessionService/ListSessions", "{}").status, 0);
}

TEST(SecuredWeb, ARenewedCertificateIsShownToNewConnections) {
  SecuredServer secured;
  const std::string token = secured.AddToken("tablet museum read");
  server::ServerOptions options = AlsoByWeb(secured.WithCallers());
  secured.Encrypt(options, false);
  secured.Start(options);
  const int port = secured.server().web_port();
  WebClient before(port, &secured.authority());
  EXPECT_EQ(CallBy(before, "SessionService/ListSessions", "{}", Showing(token)).status, 200);
  // The new one is of another authority, so who trusts the old one alone is not let down silently.
  const fixture::TestAuthority next("next authority");
  const fixture::CertifiedKey renewed = next.Issue("server", "IP:127.0.0.1");
  fixture::WriteTestFile(secured.File("key.pem"), renewed.key);
  fixture::WriteTestFile(secured.File("cert.pem"), renewed.certificate);
  secured.server().RefreshTlsFiles();
  WebClient after(port, &next);
  EXPECT_EQ(CallBy(after, "SessionService/ListSessions", "{}", Showing(token)).status, 200);
  EXPECT_FALSE(WebClient(port, &secured.authority()).connected());
  EXPECT_EQ(CallBy(before, "SessionService/ListSessions", "{}", Showing(token)).status, 200);
}

TEST(SecuredWeb, AnAddressThatOthersReachHasToBeProtected) {
  SecuredServer secured;
  store::MemoryStore store(1 << 20);
  telemetry::Log log = telemetry::Log::Silent();
  server::ServerOptions options;
  options.listen = {"127.0.0.1:0"};
  options.web_listen = "0.0.0.0:0";
  EXPECT_TRUE(absl::IsInvalidArgument(server::Server::Start(options, store, log).status()));
  options.web_listen = "127.0.0.1:0";
  options.access.tenant_metadata = "vantage-web-peer";
  EXPECT_TRUE(absl::IsInvalidArgument(server::Server::Start(options, store, log).status()));
  options.access.tenant_metadata = "";
  options.web_root = secured.File("no page");
  EXPECT_TRUE(absl::IsInvalidArgument(server::Server::Start(options, store, log).status()));
}

}  // namespace
}  // namespace vantage::web
