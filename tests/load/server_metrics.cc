#include "tests/load/server_metrics.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <vector>

#include "absl/strings/str_split.h"

namespace vantage::load {

std::map<std::string, double> ReadMetrics(int port) {
  const int to = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{10, 0};
  setsockopt(to, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string answer;
  // NOLINTNEXTLINE: how sockets are told
  if (connect(to, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
    const std::string request =
        "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    send(to, request.data(), request.size(), MSG_NOSIGNAL);
    std::array<char, 8192> part{};
    for (ssize_t n = 0; (n = recv(to, part.data(), part.size(), 0)) > 0;) {
      answer.append(part.data(), static_cast<size_t>(n));
    }
  }
  close(to);
  std::map<std::string, double> samples;
  const size_t body = answer.find("\r\n\r\n");
  if (body == std::string::npos) return samples;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(answer).substr(body + 4), '\n')) {
    const size_t space = line.rfind(' ');
    if (line.empty() || line[0] == '#' || space == absl::string_view::npos) continue;
    samples[std::string(line.substr(0, space))] =
        std::strtod(std::string(line.substr(space + 1)).c_str(), nullptr);
  }
  return samples;
}

}  // namespace vantage::load
