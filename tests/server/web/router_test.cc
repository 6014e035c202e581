#include "server/web/router.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/rpc/services.h"

namespace vantage::web {
namespace {

using ::testing::HasSubstr;

constexpr char kList[] = "/vantage.v1.SessionService/ListSessions";
constexpr char kFriend[] = "https://crew.example";

Router MakeRouter(bool identified, std::vector<std::string> origins = {}) {
  return {{rpc::Services::Names(), std::move(origins), identified}, PageFiles()};
}

Request Asking(const std::string& method, const std::string& target, const std::string& host,
               const std::string& origin = "") {
  Request request;
  request.method = method;
  request.target = target;
  request.fields = {{"host", host}, {"content-type", "application/json"}};
  if (!origin.empty()) request.fields.push_back({"origin", origin});
  return request;
}

// 0: a call is let through.
int StatusOf(const Router& router, const Request& request) {
  const auto answer = router.Route(request);
  const auto* response = std::get_if<Response>(&answer);
  return response == nullptr ? 0 : response->status;
}

std::string FieldIn(const std::variant<CallRequest, Response>& answer, const std::string& name) {
  for (const Field& field : std::get<Response>(answer).fields) {
    if (field.name == name) return field.value;
  }
  return "";
}

TEST(Router, RpcsAndThePageHaveTheirPaths) {
  const Router router = MakeRouter(true);
  EXPECT_EQ(StatusOf(router, Asking("POST", kList, "x")), 0);
  EXPECT_EQ(StatusOf(router, Asking("POST", "/vantage.v1.SessionService/None", "x")), 404);
  EXPECT_EQ(StatusOf(router, Asking("GET", "/vantage.v1.SessionService/None", "x")), 404);
  EXPECT_EQ(StatusOf(router, Asking("POST", "/grpc.health.v1.Health/Check", "x")), 405);
  EXPECT_EQ(StatusOf(router, Asking("GET", "/", "x")), 404);
}

TEST(Router, PagesOfOtherOriginsMayNotCall) {
  const Router router = MakeRouter(true);
  EXPECT_EQ(StatusOf(router, Asking("POST", kList, "a.example", "https://a.example")), 0);
  EXPECT_EQ(StatusOf(router, Asking("POST", kList, "A.example:81", "http://a.example:81")), 0);
  for (const char* origin : {"https://b.example", "https://a.example:8443", "null", kFriend,
                             "https://a.example.b.example", "file://"}) {
    const auto refused = router.Route(Asking("POST", kList, "a.example", origin));
    ASSERT_TRUE(std::holds_alternative<Response>(refused)) << origin;
    EXPECT_EQ(std::get<Response>(refused).status, 403) << origin;
    EXPECT_EQ(FieldIn(refused, "access-control-allow-origin"), "");
    EXPECT_EQ(StatusOf(router, Asking("OPTIONS", kList, "a.example", origin)), 405);
  }
}

TEST(Router, ConfiguredOriginsMayCallAndAreToldSo) {
  const Router router = MakeRouter(true, {kFriend});
  EXPECT_EQ(StatusOf(router, Asking("POST", kList, "a.example", kFriend)), 0);
  const auto preflight = router.Route(Asking("OPTIONS", kList, "a.example", kFriend));
  EXPECT_EQ(std::get<Response>(preflight).status, 204);
  EXPECT_EQ(FieldIn(preflight, "access-control-allow-origin"), kFriend);
  EXPECT_EQ(FieldIn(preflight, "access-control-allow-methods"), "POST");
  EXPECT_THAT(FieldIn(preflight, "access-control-allow-headers"), HasSubstr("authorization"));
  EXPECT_EQ(FieldIn(preflight, "vary"), "origin");
  EXPECT_EQ(StatusOf(router, Asking("POST", kList, "a.example", "https://b.example")), 403);
  EXPECT_EQ(FieldIn(router.Route(Asking("OPTIONS", kList, "a.example", "https://b.example")),
                    "access-control-allow-origin"),
            "");
  Response answer;
  router.Permit(Asking("POST", kList, "a.example", kFriend), answer);
  ASSERT_EQ(answer.fields.size(), 2);
  EXPECT_EQ(answer.fields[1].value, kFriend);
}

// A page of a foreign name that was given this server's address (DNS rebinding) is of the same
// origin, and would be let in where nobody shows who they are.
TEST(Router, WhereAnybodyMayCallTheServerIsAskedForByItsAddress) {
  const Router open = MakeRouter(false, {"http://scan.local:7466"});
  for (const char* host : {"127.0.0.1:7466", "localhost", "localhost:80", "[::1]:7466",
                           "192.168.1.5", "[fe80::1]", "scan.local:7466", "LOCALHOST:1"}) {
    EXPECT_EQ(StatusOf(open, Asking("POST", kList, host)), 0) << host;
  }
  for (const char* host : {"evil.example", "evil.example:7466", "127.0.0.1.evil.example",
                           "localhost.evil.example", "scan.local:80", "", "1270.0.0.1"}) {
    EXPECT_EQ(StatusOf(open, Asking("POST", kList, host)), 421) << host;
    EXPECT_EQ(StatusOf(open, Asking("GET", "/", host)), 421) << host;
  }
  EXPECT_EQ(StatusOf(MakeRouter(true), Asking("POST", kList, "evil.example")), 0);
}

}  // namespace
}  // namespace vantage::web
