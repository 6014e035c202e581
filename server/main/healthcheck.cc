#include "server/main/healthcheck.h"

#include <grpcpp/grpcpp.h>

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace vantage::server {

namespace {

constexpr char kHttp[] = "http://";

struct CloseFile {
  ~CloseFile() {
    if (file >= 0) close(file);
  }
  int file;
};

// GET /readyz; anything but 200 within 3 s is an error.
absl::Status CheckHttp(const std::string& address) {
  const size_t colon = address.rfind(':');
  const auto fails = [&address](absl::string_view why) {
    return absl::UnavailableError(absl::StrCat(address, " ", why));
  };
  if (colon == std::string::npos) return fails("is not HOST:PORT");
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(address.substr(0, colon).c_str(), address.substr(colon + 1).c_str(), &hints,
                  &found) != 0) {
    return fails("is not known");
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, freeaddrinfo);
  const CloseFile link{socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  const timeval patience{3, 0};
  setsockopt(link.file, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(link.file, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  const std::string request =
      absl::StrCat("GET /readyz HTTP/1.1\r\nHost: ", address, "\r\nConnection: close\r\n\r\n");
  if (connect(link.file, found->ai_addr, found->ai_addrlen) != 0 ||
      send(link.file, request.data(), request.size(), MSG_NOSIGNAL) !=
          static_cast<ssize_t>(request.size())) {
    return fails("does not answer");
  }
  std::string answer;
  std::array<char, 1024> part{};
  for (ssize_t n = 0;
       answer.size() < 8192 && (n = recv(link.file, part.data(), part.size(), 0)) > 0;) {
    answer.append(part.data(), static_cast<size_t>(n));
  }
  if (absl::StartsWith(answer, "HTTP/1.1 200 ")) return absl::OkStatus();
  const size_t body = answer.find("\r\n\r\n");
  if (body == std::string::npos) return fails("does not answer");
  return fails(absl::StrCat("is ", absl::StripAsciiWhitespace(answer.substr(body + 4))));
}

}  // namespace

absl::Status CheckHealth(const std::string& address) {
  if (absl::StartsWith(address, kHttp)) return CheckHttp(address.substr(sizeof(kHttp) - 1));
  const auto stub = grpc::health::v1::Health::NewStub(
      grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(3));
  const grpc::health::v1::HealthCheckRequest request;
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, request, &response);
  if (!status.ok()) {
    return absl::UnavailableError(
        absl::StrCat(address, " does not answer: ", status.error_message()));
  }
  if (response.status() != grpc::health::v1::HealthCheckResponse::SERVING) {
    return absl::UnavailableError(
        absl::StrCat(address, " is ",
                     grpc::health::v1::HealthCheckResponse::ServingStatus_Name(response.status())));
  }
  return absl::OkStatus();
}

}  // namespace vantage::server
