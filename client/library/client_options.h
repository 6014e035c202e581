// How a client reaches its server.
#ifndef VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_
#define VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_

#include <functional>
#include <optional>
#include <string>

namespace vantage::client {

struct ClientOptions {
  std::string server = "127.0.0.1:7464";  // host:port
  // PEM file of what signed the server's certificate; without it the link is not encrypted.
  std::string tls_ca;
  // PEM files of the client's own certificate and key, where the server asks for them.
  std::string tls_cert;
  std::string tls_key;
  // File with a bearer token, read again for every call; it is only sent over an encrypted link, or
  // within this machine.
  std::string token_file;
  std::string traceparent;     // W3C Trace Context that every call belongs to
  double timeout = 30;         // s, of a unary call, all its attempts together
  int attempts = 4;            // of a unary call while the server is unavailable
  double give_up_after = 120;  // s without any progress, of uploads and watches
  // A server that loads a job's model, after a start or after nobody used it, is waited for, so
  // long at most; `timeout` and `attempts` begin with its answer.
  double loading_patience = 900;  // s
  // For a progress line: is called when a unary call begins (true) and ends (false), all its
  // attempts together.
  std::function<void(bool begins)> on_call;
  // Likewise: is called before each wait for a model with the seconds since the first,
  // and with nothing when it is over.
  std::function<void(std::optional<double> seconds)> on_loading;
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_
