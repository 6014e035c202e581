#include "server/telemetry/http_listener.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace vantage::telemetry {
namespace {

constexpr unsigned kConnections = 64;
constexpr unsigned kConnectionsOfOneAddress = 32;
constexpr unsigned kIdleSeconds = 10;
constexpr size_t kConnectionMemory = 16 << 10;

absl::StatusOr<sockaddr_storage> ParseAddress(const std::string& address) {
  const size_t colon = address.rfind(':');
  int port = -1;
  sockaddr_storage parsed{};
  if (colon != std::string::npos && absl::SimpleAtoi(address.substr(colon + 1), &port) &&
      port >= 0 && port <= 65535) {
    std::string host = address.substr(0, colon);
    if (host == "localhost") host = "127.0.0.1";
    auto* v4 = reinterpret_cast<sockaddr_in*>(&parsed);   // NOLINT: how sockets are told
    auto* v6 = reinterpret_cast<sockaddr_in6*>(&parsed);  // NOLINT
    if (inet_pton(AF_INET, host.c_str(), &v4->sin_addr) == 1) {
      v4->sin_family = AF_INET;
      v4->sin_port = htons(static_cast<uint16_t>(port));
      return parsed;
    }
    if (host.size() > 2 && host.front() == '[' && host.back() == ']' &&
        inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &v6->sin6_addr) == 1) {
      v6->sin6_family = AF_INET6;
      v6->sin6_port = htons(static_cast<uint16_t>(port));
      return parsed;
    }
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", address, "' is no address: 127.0.0.1:PORT or [::1]:PORT"));
}

MHD_Result Send(MHD_Connection* connection, const HttpAnswer& answer) {
  // The library copies the text.
  MHD_Response* response = MHD_create_response_from_buffer(
      answer.body.size(), const_cast<char*>(answer.body.data()),  // NOLINT: the library's signature
      MHD_RESPMEM_MUST_COPY);
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer.type.c_str());
  MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
  MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
  MHD_add_response_header(response, "Content-Security-Policy",
                          "default-src 'none'; style-src 'unsafe-inline'");
  if (answer.code == MHD_HTTP_METHOD_NOT_ALLOWED) {
    MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
  }
  const MHD_Result sent =
      MHD_queue_response(connection, static_cast<unsigned>(answer.code), response);
  MHD_destroy_response(response);
  return sent;
}

MHD_Result Handle(void* closure, MHD_Connection* connection, const char* url, const char* method,
                  const char*, const char*, size_t* upload_size, void** state) {
  const auto& pages = *static_cast<const std::map<std::string, HttpListener::Page>*>(closure);
  // The first call comes with the headers; a request's body is ignored.
  static char begun;
  if (*state == nullptr) {
    *state = &begun;
    return MHD_YES;
  }
  if (*upload_size > 0) {
    *upload_size = 0;
    return MHD_YES;
  }
  if (std::strcmp(method, MHD_HTTP_METHOD_GET) != 0 &&
      std::strcmp(method, MHD_HTTP_METHOD_HEAD) != 0) {
    return Send(connection, {MHD_HTTP_METHOD_NOT_ALLOWED, "text/plain", "only GET\n"});
  }
  const auto page = pages.find(url);
  if (page == pages.end()) {
    return Send(connection, {MHD_HTTP_NOT_FOUND, "text/plain", "no such page\n"});
  }
  return Send(connection, page->second());
}

}  // namespace

struct HttpListener::Daemon {
  explicit Daemon(MHD_Daemon* d) : daemon(d) {}
  ~Daemon() { MHD_stop_daemon(daemon); }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  MHD_Daemon* const daemon;
};

HttpListener::HttpListener() = default;
HttpListener::~HttpListener() = default;

absl::StatusOr<std::unique_ptr<HttpListener>> HttpListener::Start(
    const std::string& address, std::map<std::string, Page> pages) {
  const absl::StatusOr<sockaddr_storage> where = ParseAddress(address);
  if (!where.ok()) return where.status();
  std::unique_ptr<HttpListener> listener(new HttpListener);
  listener->pages_ = std::move(pages);
  unsigned flags = MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_POLL;
  if (where->ss_family == AF_INET6) flags |= MHD_USE_IPv6;
  MHD_Daemon* daemon = MHD_start_daemon(
      flags, 0, nullptr, nullptr, &Handle, &listener->pages_, MHD_OPTION_SOCK_ADDR, &*where,
      MHD_OPTION_CONNECTION_LIMIT, kConnections, MHD_OPTION_PER_IP_CONNECTION_LIMIT,
      kConnectionsOfOneAddress, MHD_OPTION_CONNECTION_TIMEOUT, kIdleSeconds,
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, kConnectionMemory, MHD_OPTION_END);
  const MHD_DaemonInfo* info =
      daemon == nullptr ? nullptr : MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_BIND_PORT);
  if (daemon != nullptr) listener->daemon_ = std::make_unique<Daemon>(daemon);
  if (info == nullptr) {
    return absl::UnavailableError(absl::StrCat("cannot listen on '", address, "' for HTTP"));
  }
  listener->port_ = info->port;
  return listener;
}

}  // namespace vantage::telemetry
