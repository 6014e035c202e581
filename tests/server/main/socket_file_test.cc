// Where a server may listen in the file system, and who gets in.
#include "server/main/socket_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/main/healthcheck.h"
#include "server/main/server.h"
#include "server/store/memory_store.h"

namespace vantage::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class SocketFile : public testing::Test {
 protected:
  ~SocketFile() override { unlink(path_.c_str()); }

  absl::StatusOr<std::unique_ptr<Server>> Start(std::vector<std::string> listen) {
    ServerOptions options;
    options.listen = std::move(listen);
    options.threads = 1;
    return Server::Start(options, store_, log_);
  }
  // As a server that was killed leaves it.
  void LeaveASocketBehind() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    const int file = socket(AF_UNIX, SOCK_STREAM, 0);
    const auto* any = reinterpret_cast<const sockaddr*>(&address);  // NOLINT
    ASSERT_EQ(bind(file, any, sizeof address), 0);
    close(file);
  }

  const std::string path_ = absl::StrCat(testing::TempDir(), "/socket-", getpid());
  store::MemoryStore store_{1 << 20};
  telemetry::Log log_ = telemetry::Log::Silent();
};

TEST_F(SocketFile, PathsAreTakenFromAddresses) {
  EXPECT_EQ(SocketPath("unix:/run/v.sock"), "/run/v.sock");
  EXPECT_EQ(SocketPath("unix:///run/v.sock"), "/run/v.sock");
  EXPECT_EQ(SocketPath("unix:v.sock"), "v.sock");
  EXPECT_EQ(SocketPath("127.0.0.1:7464"), "");
  EXPECT_EQ(SocketPath("unix-abstract:v"), "");
}

TEST_F(SocketFile, IsServedBesideAPortToOwnerAndGroupAlone) {
  const mode_t before = umask(0);
  const auto server = Start({"unix:" + path_, "127.0.0.1:0"});
  EXPECT_EQ(umask(before), 0U);
  ASSERT_TRUE(server.ok()) << server.status();
  struct stat made {};
  ASSERT_EQ(stat(path_.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 07777U, 0660U);
  const std::string port = absl::StrCat("127.0.0.1:", (*server)->port());
  EXPECT_THAT((*server)->addresses(), ElementsAre("unix:" + path_, port));
  EXPECT_GT((*server)->port(), 1);
  EXPECT_TRUE(CheckHealth("unix:" + path_).ok());
  EXPECT_TRUE(CheckHealth(port).ok());
}

TEST_F(SocketFile, WhatAKilledServerLeftIsNoHindrance) {
  LeaveASocketBehind();
  const auto server = Start({"unix:" + path_});
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_EQ((*server)->port(), 0);
  EXPECT_TRUE(CheckHealth("unix:" + path_).ok());
}

TEST_F(SocketFile, OfAnotherServerIsRefusedAndStaysIts) {
  const auto first = Start({"unix:" + path_});
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = Start({"127.0.0.1:0", "unix:" + path_});
  EXPECT_TRUE(absl::IsUnavailable(second.status())) << second.status();
  EXPECT_THAT(std::string(second.status().message()),
              HasSubstr(path_ + "': another server listens there"));
  EXPECT_TRUE(CheckHealth("unix:" + path_).ok());
}

TEST_F(SocketFile, ThatIsSomethingElseIsLeftAsItIs) {
  std::ofstream(path_) << "precious";
  const auto server = Start({"unix:" + path_});
  EXPECT_TRUE(absl::IsInvalidArgument(server.status())) << server.status();
  EXPECT_THAT(std::string(server.status().message()), HasSubstr("no socket"));
  std::string text;
  std::ifstream(path_) >> text;
  EXPECT_EQ(text, "precious");
}

TEST_F(SocketFile, APathThatCannotBeUsedIsNamed) {
  const auto nowhere = Start({"unix:" + path_ + "/no/folder"});
  EXPECT_TRUE(absl::IsUnavailable(nowhere.status())) << nowhere.status();
  EXPECT_THAT(std::string(nowhere.status().message()), HasSubstr(path_ + "/no/folder"));
  const auto long_path = Start({"unix:/tmp/" + std::string(200, 'x')});
  EXPECT_TRUE(absl::IsInvalidArgument(long_path.status())) << long_path.status();
  EXPECT_THAT(std::string(long_path.status().message()), HasSubstr("107 bytes"));
}

// Without callers, whoever reached the proxy could do everything; without a socket it is never
// believed.
TEST_F(SocketFile, AProxyNeedsCallersAndASocket) {
  const std::string callers = path_ + "-callers";
  std::ofstream(callers) << "";
  chmod(callers.c_str(), 0600);
  for (const bool certificate : {false, true}) {
    ServerOptions options;
    (certificate ? options.access.certificate_metadata : options.access.address_metadata) = "x-a";
    const auto start = [&] {
      return std::string(Server::Start(options, store_, log_).status().message());
    };
    options.listen = {"unix:" + path_};
    EXPECT_THAT(start(), HasSubstr("need --callers"));
    options.access.callers_file = callers;
    options.listen = {"127.0.0.1:0"};
    EXPECT_THAT(start(), HasSubstr("--listen unix:PATH"));
    options.listen = {"127.0.0.1:0", "unix:" + path_};
    EXPECT_EQ(start(), "");
  }
  unlink(callers.c_str());
}

}  // namespace
}  // namespace vantage::server
