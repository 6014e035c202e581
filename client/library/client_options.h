// How a client reaches its server.
#ifndef VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_
#define VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_

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
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_CLIENT_OPTIONS_H_
