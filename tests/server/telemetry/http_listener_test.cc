#include "server/telemetry/http_listener.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

namespace vantage::telemetry {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

int Connect(int port) {
  const int to = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // NOLINTNEXTLINE: how sockets are told
  if (connect(to, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    close(to);
    return -1;
  }
  const timeval patience{60, 0};
  setsockopt(to, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  return to;
}

// What comes until the other end closes.
std::string ReadAll(int from) {
  std::string all;
  std::array<char, 4096> part;
  for (ssize_t n = 0; (n = recv(from, part.data(), part.size(), 0)) > 0;) {
    all.append(part.data(), static_cast<size_t>(n));
  }
  return all;
}

std::string Ask(int port, const std::string& request) {
  const int to = Connect(port);
  EXPECT_GE(to, 0);
  send(to, request.data(), request.size(), MSG_NOSIGNAL);
  std::string answer = ReadAll(to);
  close(to);
  return answer;
}

std::string Request(const std::string& method, const std::string& path,
                    const std::string& headers = "", const std::string& body = "") {
  return method + " " + path + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n" + headers + "\r\n" +
         body;
}

std::unique_ptr<HttpListener> Listen() {
  auto listener =
      HttpListener::Start("127.0.0.1:0", {{"/page",
                                           [] {
                                             return HttpAnswer{200, "text/plain", "hello\n"};
                                           }},
                                          {"/not", [] {
                                             return HttpAnswer{503, "text/plain", "not now\n"};
                                           }}});
  EXPECT_TRUE(listener.ok()) << listener.status();
  return *std::move(listener);
}

TEST(HttpListener, AnswersItsPagesAndNothingElse) {
  const auto listener = Listen();
  const int port = listener->port();
  const std::string page = Ask(port, Request("GET", "/page"));
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(page, EndsWith("\r\n\r\nhello\n"));
  EXPECT_THAT(Ask(port, Request("GET", "/not")), StartsWith("HTTP/1.1 503 "));
  const std::string head = Ask(port, Request("HEAD", "/page"));
  EXPECT_THAT(head, StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(head, EndsWith("\r\n\r\n"));
  for (const char* path : {"/", "/page/", "/../page/..", "/etc/passwd", "//page"}) {
    EXPECT_THAT(Ask(port, Request("GET", path)), StartsWith("HTTP/1.1 404 ")) << path;
  }
  const std::string post = Ask(port, Request("POST", "/page", "Content-Length: 5\r\n", "12345"));
  EXPECT_THAT(post, StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(post, HasSubstr("Allow: GET, HEAD"));
}

TEST(HttpListener, NonsenseAndFloodsAreCutOff) {
  const auto listener = Listen();
  const int port = listener->port();
  Ask(port, std::string("\0\x01\x02 nonsense \r\n\r\n", 16));
  const std::string flood =
      Ask(port, Request("GET", "/page", "X-Long: " + std::string(1 << 20, 'x') + "\r\n"));
  EXPECT_EQ(flood.find(" 200 "), std::string::npos);
  EXPECT_THAT(Ask(port, Request("GET", "/page")), StartsWith("HTTP/1.1 200 "));
}

// Connections that say nothing don't keep others out for long, and are limited.
TEST(HttpListener, SilentConnectionsAreLimited) {
  const auto listener = Listen();
  std::vector<int> silent;
  silent.reserve(200);
  for (int i = 0; i < 200; ++i) silent.push_back(Connect(listener->port()));
  for (const int one : silent) close(one);
  // As soon as it has noticed that they are gone.
  std::string answer;
  for (int tries = 0; tries < 10'000 && answer.empty(); ++tries) {
    answer = Ask(listener->port(), Request("GET", "/page"));
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 "));
}

TEST(HttpListener, AddressesThatAreNoneAreRefused) {
  for (const char* bad : {"", "localhost", "127.0.0.1", "127.0.0.1:70000", "example.org:80",
                          "127.0.0.1:x", "[::1:80"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(HttpListener::Start(bad, {}).status())) << bad;
  }
  const auto first = Listen();
  EXPECT_TRUE(absl::IsUnavailable(
      HttpListener::Start("127.0.0.1:" + std::to_string(first->port()), {}).status()));
}

}  // namespace
}  // namespace vantage::telemetry
