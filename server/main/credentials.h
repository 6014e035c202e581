// The credentials that ports and sockets ask of connections.
#ifndef VANTAGE_SERVER_MAIN_CREDENTIALS_H_
#define VANTAGE_SERVER_MAIN_CREDENTIALS_H_

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/auth/access_options.h"
#include "server/auth/tls_files.h"

namespace vantage::server {

// True for 127.0.0.0/8, [::1], localhost and unix sockets, with or without a port.
bool IsLoopback(const std::string& address);

struct Credentials {
  std::shared_ptr<grpc::ServerCredentials> ports;
  // Sockets of the file system: their permissions protect them.
  std::shared_ptr<grpc::ServerCredentials> sockets;
  // What the ports read, which outlives them; null: they are not encrypted.
  std::unique_ptr<auth::TlsFiles> files;
};

// INVALID_ARGUMENT, which says what to do: options that contradict each other, unusable files, or
// an address of `listen`, or that of the web where it is not empty, that is neither loopback nor
// protected.
absl::StatusOr<Credentials> MakeCredentials(const auth::AccessOptions& access,
                                            const std::vector<std::string>& listen,
                                            const std::string& web_listen = "");

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_CREDENTIALS_H_
