// A small HTTP listener beside gRPC, for monitors and people.
#ifndef VANTAGE_SERVER_TELEMETRY_HTTP_LISTENER_H_
#define VANTAGE_SERVER_TELEMETRY_HTTP_LISTENER_H_

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace vantage::telemetry {

struct HttpAnswer {
  int code = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

// Answers GET and HEAD of fixed paths, on one thread; connections, their memory and their time are
// bounded.
class HttpListener {
 public:
  // Called on the listener's thread, one at a time.
  using Page = std::function<HttpAnswer()>;

  // `address` as in '127.0.0.1:7465' or '[::1]:0'. INVALID_ARGUMENT: not an address; UNAVAILABLE:
  // it cannot be bound.
  static absl::StatusOr<std::unique_ptr<HttpListener>> Start(const std::string& address,
                                                             std::map<std::string, Page> pages);
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  int port() const { return port_; }

 private:
  struct Daemon;
  HttpListener();

  int port_ = 0;
  std::map<std::string, Page> pages_;
  std::unique_ptr<Daemon> daemon_;
};

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_HTTP_LISTENER_H_
