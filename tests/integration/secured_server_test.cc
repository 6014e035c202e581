// The real server behind certificates and tokens, called by the real command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/certificates.h"
#include "tests/server/fixture/jwt_signer.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;

constexpr int kRefused = 5;
constexpr int kUnreachable = 4;

// Token and line of the callers file, as 'vantaged token' prints them.
std::pair<std::string, std::string> NewCaller(const std::string& name, const std::string& tenant,
                                              const std::string& roles) {
  const Finished made = RunProgram({VANTAGED_BINARY, "token", name, tenant, roles, "--days", "1"});
  EXPECT_EQ(made.exit_code, 0) << made.error;
  const std::vector<std::string> lines = absl::StrSplit(made.out, '\n');
  EXPECT_EQ(lines.size(), 3U) << made.out;
  return {lines[0], lines[1]};
}

class SecuredServer : public ::testing::Test {
 protected:
  SecuredServer() : authority_("test authority") {
    const fixture::CertifiedKey own = authority_.Issue("server", "IP:127.0.0.1");
    fixture::WriteTestFile(Path("ca.pem"), authority_.certificate());
    fixture::WriteTestFile(Path("cert.pem"), own.certificate);
    fixture::WriteTestFile(Path("key.pem"), own.key);
  }
  std::string Path(const std::string& name) const { return folder_.File(name); }
  void WriteCallers(const std::string& text) const {
    fixture::WriteTestFile(Path("callers"), text);
    chmod(Path("callers").c_str(), 0600);
  }
  std::vector<std::string> Flags() const {
    return {"--tls-cert",    Path("cert.pem"), "--tls-key",
            Path("key.pem"), "--callers",      Path("callers")};
  }

  const ScratchFolder folder_;
  const fixture::TestAuthority authority_;
};

TEST_F(SecuredServer, IsUsedByTheCommandLineWithATokenOverTls) {
  const auto [token, line] = NewCaller("tablet-7", "museum", "submit,plan,read");
  const auto [other_token, other_line] = NewCaller("tablet-8", "castle", "submit,plan,read");
  WriteCallers(line + "\n" + other_line + "\n");
  fixture::WriteTestFile(Path("token"), token + "\n");
  fixture::WriteTestFile(Path("other"), other_token + "\n");
  const ServerProcess server("", "127.0.0.1", Flags());
  // Without patience: what cannot be reached stays so.
  const auto vantage = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {VANTAGE_BINARY, "--server", server.address(), "--timeout", "5"});
    return RunProgram(arguments);
  };
  const auto run = [&](const std::string& token_file, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {"--tls-ca", Path("ca.pem"), "--token-file", Path(token_file)});
    return vantage(arguments);
  };
  const Finished created = run("token", {"session", "create", "job"});
  EXPECT_EQ(created.exit_code, 0) << created.error;
  EXPECT_THAT(run("token", {"session", "list"}).out, HasSubstr("job"));
  EXPECT_EQ(run("other", {"session", "show", "job"}).exit_code, 3);
  const Finished refused = run("token", {"session", "delete", "job"});
  EXPECT_EQ(refused.exit_code, kRefused);
  EXPECT_THAT(refused.error, HasSubstr("needs the role administer"));

  // Without a token, without TLS, with a certificate of somebody else's authority.
  const Finished nobody = vantage({"--tls-ca", Path("ca.pem"), "session", "list"});
  EXPECT_EQ(nobody.exit_code, kRefused);
  EXPECT_THAT(nobody.error, HasSubstr("--token-file"));
  EXPECT_EQ(vantage({"session", "list"}).exit_code, kUnreachable);
  fixture::WriteTestFile(Path("ca.pem"), fixture::TestAuthority("another").certificate());
  EXPECT_EQ(run("token", {"session", "list"}).exit_code, kUnreachable);

  EXPECT_THAT(server.Log(), HasSubstr("\"level\":\"audit\",\"message\":\"audit\","
                                      "\"caller\":\"tablet-7\",\"tenant\":\"museum\""));
  EXPECT_EQ(server.Log().find(token), std::string::npos);
}

TEST_F(SecuredServer, ReadsItsCallersAgainOnHangup) {
  const auto [token, line] = NewCaller("tablet-7", "museum", "administer");
  WriteCallers("");
  fixture::WriteTestFile(Path("token"), token);
  ServerProcess server("", "127.0.0.1", {"--callers", Path("callers")});
  const std::vector<std::string> list = {"--token-file", Path("token"), "session", "list"};
  EXPECT_EQ(Vantage(server, list).exit_code, kRefused);
  WriteCallers(line);
  server.Signal(SIGHUP);
  // The signal is on its way.
  int code = kRefused;
  for (int tries = 0; tries < 200 && code == kRefused; ++tries) {
    code = Vantage(server, list).exit_code;
  }
  EXPECT_EQ(code, 0);
}

// A token file is read for each call, so whoever renews the token only has to write it.
TEST_F(SecuredServer, TakesAnIdentityProvidersTokensAndTheirRenewals) {
  const fixture::JwtSigner signer("P-256", "k");
  fixture::WriteTestFile(Path("keys.json"), signer.KeySet());
  chmod(Path("keys.json").c_str(), 0600);
  const ServerProcess server(
      "", "127.0.0.1",
      {"--jwt-keys", Path("keys.json"), "--jwt-issuer", "login", "--jwt-audience", "scans",
       "--jwt-roles-claim", "scope", "--jwt-tenant-claim", "org", "--jwt-role-prefix",
       "vantage:", "--backups-keep-days", "30"});
  const auto write = [&](absl::Duration left) {
    fixture::WriteTestFile(
        Path("token"),
        signer.Token(absl::StrCat(R"({"iss":"login","aud":"scans","sub":"anna","org":"museum",)",
                                  R"("scope":"openid vantage:administer","exp":)",
                                  absl::ToUnixSeconds(absl::Now() + left), "}")) +
            "\n");
  };
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--token-file", Path("token")});
    return Vantage(server, arguments);
  };
  write(absl::Hours(1));
  const Finished created = run({"session", "create", "job"});
  EXPECT_EQ(created.exit_code, 0) << created.error;
  write(-absl::Minutes(1));
  const Finished expired = run({"session", "list"});
  EXPECT_EQ(expired.exit_code, kRefused);
  EXPECT_THAT(expired.error, HasSubstr("expired"));
  write(absl::Hours(1));
  const Finished deleted = run({"session", "delete", "job"});
  EXPECT_EQ(deleted.exit_code, 0) << deleted.error;
  EXPECT_THAT(deleted.out, HasSubstr("backup"));
}

TEST_F(SecuredServer, ATokenDoesNotTravelInTheClear) {
  fixture::WriteTestFile(Path("token"), "vantage_secret");
  const Finished refused = RunProgram({VANTAGE_BINARY, "--server", "192.0.2.1:7464", "--token-file",
                                       Path("token"), "session", "list"});
  EXPECT_EQ(refused.exit_code, kRefused);
  EXPECT_THAT(refused.error, HasSubstr("--tls-ca"));
}

TEST_F(SecuredServer, WhatDoesNotFitTogetherStopsTheStart) {
  const auto start = [](std::vector<std::string> flags) {
    flags.insert(flags.begin(), {VANTAGED_BINARY, "--in-memory"});
    return RunProgram(flags);
  };
  const Finished open = start({"--listen", "0.0.0.0:0"});
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_THAT(open.error, HasSubstr("--allow-insecure-remote"));
  EXPECT_EQ(start({"--listen", "127.0.0.1:0", "--tls-cert", Path("cert.pem")}).exit_code, 2);
  EXPECT_EQ(start({"--listen", "127.0.0.1:0", "--callers", Path("none")}).exit_code, 2);
  WriteCallers("nonsense");
  const Finished bad = start({"--listen", "127.0.0.1:0", "--callers", Path("callers")});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.error, HasSubstr("line 1"));
  const Finished anybodys = start({"--listen", "127.0.0.1:0", "--jwt-keys", Path("callers")});
  EXPECT_EQ(anybodys.exit_code, 2);
  EXPECT_THAT(anybodys.error, HasSubstr("--jwt-audience"));
  const Finished no_keys = start({"--listen", "127.0.0.1:0", "--jwt-keys", Path("callers"),
                                  "--jwt-issuer", "i", "--jwt-audience", "a"});
  EXPECT_EQ(no_keys.exit_code, 2);
  EXPECT_THAT(no_keys.error, HasSubstr("JSON Web Key Set"));
}

}  // namespace
}  // namespace vantage::integration
