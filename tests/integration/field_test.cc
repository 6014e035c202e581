// A laptop at a site, as a crew has it: one command, tablets that are paired and revoked while it
// runs, and the job that goes on at the office.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <regex>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/web_client.h"

namespace vantage::integration {
namespace {

using fixture::WebAnswer;
using fixture::WebClient;
using ::testing::HasSubstr;
using ::testing::Not;

using FieldsOfCall = std::vector<std::pair<std::string, std::string>>;

std::string TextOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A link that pairs, as it was printed; port 0: there is none.
struct Link {
  int port = 0;
  std::string token;
};
Link LinkIn(const std::string& text) {
  const std::regex form("https://127\\.0\\.0\\.1:(\\d+)/#token=(\\S+)");
  std::smatch match;
  Link link;
  if (!std::regex_search(text, match, form)) return link;
  EXPECT_TRUE(absl::SimpleAtoi(match[1].str(), &link.port));
  link.token = match[2];
  return link;
}

class FieldTest : public ::testing::Test {
 protected:
  // 'vantaged field' at loopback, so that it is the same whatever network the machine has.
  std::unique_ptr<ServerProcess> Start(int port = 0) const {
    return std::make_unique<ServerProcess>(
        Data(), "127.0.0.1",
        std::vector<std::string>{"field", "--address", "127.0.0.1", "--port", absl::StrCat(port)});
  }
  std::string Data() const { return folder_.File("data"); }
  std::string Authority() const { return TextOf(Data() + "/field/authority.crt"); }
  // Of the devices, from another terminal.
  Finished Field(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {VANTAGED_BINARY, "field", "--data", Data()});
    return RunProgram(arguments);
  }
  // The laptop's own command line, as the server says that it is called.
  Finished OnLaptop(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(),
                     {VANTAGE_BINARY, "--server", absl::StrCat("unix:", Data(), "/field/socket"),
                      "--token-file", Data() + "/field/laptop.token"});
    return RunProgram(arguments);
  }
  static FieldsOfCall Showing(const Link& link, const std::string& type = "application/json") {
    return {{"content-type", type}, {"authorization", "Bearer " + link.token}};
  }
  WebAnswer Call(const Link& link, const std::string& method, const std::string& json) const {
    WebClient tablet(link.port, Authority());
    return tablet.Ask("POST", "/vantage.v1.SessionService/" + method, Showing(link), json);
  }
  // Whether calls are let in, or are not, once the server has read its devices again. Those that
  // are refused may also be told to come more slowly (429).
  bool Becomes(const ServerProcess& server, const Link& link, bool let_in) const {
    server.Signal(SIGHUP);
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while ((Call(link, "ListSessions", "{}").status == 200) != let_in) {
      if (std::chrono::steady_clock::now() > until) return false;
    }
    return true;
  }

  const ScratchFolder folder_;
};

TEST_F(FieldTest, TabletsArePairedAndRevokedWhileItRuns) {
  const auto server = Start();
  const Link first = LinkIn(server->Log());
  ASSERT_NE(first.port, 0) << server->Log();
  EXPECT_THAT(server->Log(), HasSubstr("Pair tablet-1"));
  EXPECT_THAT(server->Log(), Not(HasSubstr("\033")));  // no code where there is no terminal

  // The authority is there for who wants to trust it, and what is there is what signed.
  WebClient stranger(first.port, Authority());
  const WebAnswer authority = stranger.Ask("GET", "/authority.crt");
  EXPECT_EQ(authority.status, 200);
  EXPECT_EQ(authority.Field("content-type"), "application/x-x509-ca-cert");
  EXPECT_EQ(absl::Base64Escape(authority.body), fixture::DerInBase64(Authority()));
  EXPECT_EQ(Call({first.port, "vantage_guessed"}, "ListSessions", "{}").status, 401);

  EXPECT_EQ(Call(first, "CreateSession", R"({"session_id":"flat"})").status, 200);
  const Finished listed = OnLaptop({"session", "list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.error;
  EXPECT_THAT(listed.out, HasSubstr("flat"));
  EXPECT_THAT(server->Log(), HasSubstr("\"caller\":\"tablet-1\""));

  const Finished paired = Field({"pair", "tablet-2"});
  ASSERT_EQ(paired.exit_code, 0) << paired.error;
  const Link second = LinkIn(paired.out);
  EXPECT_EQ(second.port, first.port);
  EXPECT_TRUE(Becomes(*server, second, true));
  EXPECT_THAT(Field({"devices"}).out, HasSubstr("tablet-2  submit,plan,read  until "));
  EXPECT_EQ(Field({"pair", "tablet-2"}).exit_code, 1);

  // What the first one watches ends, too.
  WebClient watching(first.port, Authority());
  const std::string message = R"({"name":"sessions/flat"})";
  watching.Send(fixture::WebRequest(
      "POST", "/vantage.v1.SessionService/WatchSession", Showing(first, "application/connect+json"),
      std::string("\0\0\0\0", 4) + static_cast<char>(message.size()) + message));
  EXPECT_EQ(watching.ReadHead().status, 200);
  EXPECT_EQ(watching.ReadMessage().flags, 0);
  const Finished revoked = Field({"revoke", "tablet-1"});
  EXPECT_EQ(revoked.exit_code, 0) << revoked.error;
  EXPECT_THAT(revoked.out, HasSubstr("within 2 s"));
  EXPECT_TRUE(Becomes(*server, first, false));
  fixture::WebMessage last = watching.ReadMessage();
  while (last.flags == 0) last = watching.ReadMessage();
  EXPECT_THAT(last.data, HasSubstr("CREDENTIALS_WITHDRAWN"));
  EXPECT_EQ(Call(second, "ListSessions", "{}").status, 200);
  // No token is in what the server wrote, but for the link.
  EXPECT_EQ(server->Log().find(second.token), std::string::npos);
}

TEST_F(FieldTest, AJobIsThereAfterARestartAndGoesOnAtTheOffice) {
  auto server = Start();
  const Link tablet = LinkIn(server->Log());
  ASSERT_NE(tablet.port, 0) << server->Log();
  const Finished scanned = OnLaptop({"simulate", "--step", "2", "--density", "100", "--scans", "1",
                                     "--session", "flat", "--no-hints"});
  EXPECT_EQ(scanned.exit_code, 0) << scanned.error;
  const std::string authority = Authority();
  EXPECT_EQ(server->Stop(SIGTERM), 0);
  EXPECT_THAT(Field({"pair", "tablet-2"}).error, HasSubstr("start it"));

  server = Start(tablet.port);
  EXPECT_EQ(LinkIn(server->Log()).port, 0) << server->Log();
  EXPECT_EQ(Authority(), authority);
  const WebAnswer found = Call(tablet, "GetSession", R"({"name":"sessions/flat"})");
  EXPECT_EQ(found.status, 200) << found.body;
  const std::string archive = folder_.File("flat.vantage");
  const Finished exported = OnLaptop({"export", "flat", "--format", "archive", "-o", archive});
  EXPECT_EQ(exported.exit_code, 0) << exported.error;

  const ServerProcess office;
  const Finished imported = Vantage(office, {"session", "import", archive});
  EXPECT_EQ(imported.exit_code, 0) << imported.error;
  const Finished there = Vantage(office, {"scan", "list", "flat"});
  EXPECT_EQ(there.out, OnLaptop({"scan", "list", "flat"}).out);
  EXPECT_THAT(there.out, HasSubstr("scan-1"));
}

TEST_F(FieldTest, WhatStandsInItsWayIsSaidWithWhatToDo) {
  const auto server = Start();
  const Link tablet = LinkIn(server->Log());
  ASSERT_NE(tablet.port, 0) << server->Log();
  const Finished again = Field({"--address", "127.0.0.1", "--port", "0"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.error, HasSubstr("another server uses the data"));
  EXPECT_THAT(again.error, HasSubstr("vantaged field pair NAME"));

  const auto start = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {VANTAGED_BINARY, "field", "--data", folder_.File("other")});
    return RunProgram(arguments);
  };
  const std::string port = absl::StrCat(tablet.port);
  const Finished busy = start({"--address", "127.0.0.1", "--port", port});
  EXPECT_EQ(busy.exit_code, 1);
  EXPECT_THAT(busy.error, HasSubstr("Address already in use; --port serves at another"));
  // A start that failed has paired nobody.
  EXPECT_THAT(
      RunProgram({VANTAGED_BINARY, "field", "devices", "--data", folder_.File("other")}).out,
      HasSubstr("no device is paired"));
  EXPECT_THAT(start({"--tls-cert", "x"}).error, HasSubstr("leave out --tls-cert"));
  EXPECT_EQ(start({"--address", "laptop"}).exit_code, 2);
  const Finished nowhere = RunProgram({VANTAGED_BINARY, "field", "--data", "/dev/null/jobs"});
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.error, HasSubstr("/dev/null/jobs"));
  EXPECT_THAT(nowhere.error, HasSubstr("another folder would do"));
  const Finished none = RunProgram({VANTAGED_BINARY, "field", "devices", "--data", "/nowhere"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.error, HasSubstr("--data"));
}

}  // namespace
}  // namespace vantage::integration
