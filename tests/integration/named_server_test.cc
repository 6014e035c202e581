// Servers by name, what the doctor says of one, and what a terminal gets that a file does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "tests/integration/answers.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/support/scan_files.h"
#include "vantage/v1/session.pb.h"

namespace vantage::integration {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

// Without any of the machine's own.
class NamedServer : public ::testing::Test {
 protected:
  NamedServer() {
    unsetenv("VANTAGE_SERVER");
    setenv("XDG_CONFIG_HOME", scratch_.path().c_str(), 1);
    std::filesystem::create_directory(scratch_.File("vantage"));
  }
  ~NamedServer() override { unsetenv("XDG_CONFIG_HOME"); }

  std::string Book() const { return scratch_.File("vantage/config.toml"); }
  void Write(const std::string& text) const { std::ofstream(Book()) << text; }
  static Finished Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), VANTAGE_BINARY);
    return RunProgram(arguments);
  }

  ScratchFolder scratch_;
};

std::string FindingOf(const json& told, const std::string& check) {
  for (const json& one : told["checks"]) {
    if (one["check"] == check) return one["finding"];
  }
  return "absent";
}

TEST_F(NamedServer, IsFoundByNameOrByDefault) {
  ServerProcess server;
  Write(absl::StrCat("default = \"here\"\n[servers.here]\naddress = \"", server.address(),
                     "\"\n[servers.nobody]\naddress = \"127.0.0.1:1\"\n"));
  EXPECT_EQ(Run({"health"}).exit_code, 0);
  EXPECT_EQ(Run({"--server", "here", "health"}).exit_code, 0);
  EXPECT_EQ(Run({"--server", "nobody", "health"}).exit_code, 4);
  EXPECT_EQ(Run({"--server", server.address(), "health"}).exit_code, 0);
  const Finished unknown = Run({"--server", "her", "health"});
  EXPECT_EQ(unknown.exit_code, 5);
  EXPECT_THAT(unknown.error, HasSubstr("there are here, nobody"));
  const Finished listed = Run({"servers"});
  EXPECT_THAT(listed.out, HasSubstr("where none is named"));
  EXPECT_EQ(json::parse(Run({"servers", "--json"}).out)["servers"].size(), 2u);
}

TEST_F(NamedServer, AMistakeInTheFileIsNamedWithItsLine) {
  Write("[servers.here]\nadress = \"127.0.0.1:1\"\n");
  const Finished refused = Run({"session", "list"});
  EXPECT_EQ(refused.exit_code, 5);
  EXPECT_THAT(refused.error, HasSubstr(Book() + ", line 2: a server has no key 'adress'"));
  EXPECT_THAT(refused.error, HasSubstr("fix: there are address"));
  // What needs no server works all the same.
  EXPECT_EQ(Run({"completion", "bash"}).exit_code, 0);
}

TEST_F(NamedServer, TheDoctorFindsASoundServerSound) {
  ServerProcess server;
  const Finished told = Run({"--server", server.address(), "doctor", "--quick", "--json"});
  EXPECT_EQ(told.exit_code, 0) << told.out << told.error;
  const json found = json::parse(told.out);
  EXPECT_EQ(found["sound"], true);
  for (const char* check :
       {"server", "name", "reach", "certificate", "health", "token", "role", "version"}) {
    EXPECT_EQ(FindingOf(found, check), "ok") << check << "\n" << told.out;
  }
  EXPECT_EQ(FindingOf(found, "clock"), "none");
  // It left everything as it was.
  EXPECT_THAT(Vantage(server, {"session", "list"}).out, HasSubstr("no sessions"));
}

TEST_F(NamedServer, TheDoctorReadsTheServersClock) {
  ServerProcess server;
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  const Finished told = Run({"--server", server.address(), "doctor", "--json"});
  EXPECT_EQ(told.exit_code, 0) << told.out << told.error;
  EXPECT_EQ(FindingOf(json::parse(told.out), "clock"), "ok") << told.out;
}

TEST_F(NamedServer, TheDoctorSaysWhatIsWrongAndWhatHelps) {
  const Finished nobody = Run({"--server", "127.0.0.1:1", "doctor"});
  EXPECT_EQ(nobody.exit_code, 4);
  EXPECT_THAT(nobody.out, HasSubstr("fail  reach"));
  EXPECT_THAT(nobody.out, HasSubstr("-> start the server"));
  const Finished unnamed = Run({"--server", "no-such-name.invalid:7464", "doctor"});
  EXPECT_EQ(unnamed.exit_code, 4);
  EXPECT_THAT(unnamed.out, HasSubstr("fail  name"));
  ServerProcess server;
  std::ofstream(scratch_.File("ca.pem")) << "no certificate\n";
  const Finished no_tls =
      Run({"--server", server.address(), "--tls-ca", scratch_.File("ca.pem"), "doctor"});
  EXPECT_EQ(no_tls.exit_code, 7);
  EXPECT_THAT(no_tls.out, HasSubstr("fail  certificate"));
}

TEST_F(NamedServer, OnlyATerminalGetsColourAndLinesThatAreRewritten) {
  const std::string command = absl::StrCat(VANTAGE_BINARY, " --server 127.0.0.1:1 doctor");
  const Finished piped = Run({"--server", "127.0.0.1:1", "doctor"});
  EXPECT_THAT(piped.out + piped.error, Not(HasSubstr("\033")));
  EXPECT_THAT(piped.out + piped.error, Not(HasSubstr("\r")));
  // A terminal of script's making.
  setenv("TERM", "xterm", 1);
  const Finished shown = RunProgram({"/usr/bin/env", "script", "-qec", command, "/dev/null"});
  EXPECT_THAT(shown.out, HasSubstr("\033[31mfail"));
  setenv("NO_COLOR", "1", 1);
  const Finished plain = RunProgram({"/usr/bin/env", "script", "-qec", command, "/dev/null"});
  unsetenv("NO_COLOR");
  EXPECT_THAT(plain.out, HasSubstr("fail"));
  EXPECT_THAT(plain.out, Not(HasSubstr("\033[31m")));
}

}  // namespace
}  // namespace vantage::integration
