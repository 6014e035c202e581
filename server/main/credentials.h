// The credentials that the port asks of connections.
#ifndef VANTAGE_SERVER_MAIN_CREDENTIALS_H_
#define VANTAGE_SERVER_MAIN_CREDENTIALS_H_

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/auth/access_options.h"

namespace vantage::server {

// True for 127.0.0.0/8, [::1], localhost and unix sockets, with or without a port.
bool IsLoopback(const std::string& address);

// INVALID_ARGUMENT, which says what to do: options that contradict each other, unusable files, or
// an address other than loopback that is not protected.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeCredentials(
    const auth::AccessOptions& access, const std::string& listen);

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_CREDENTIALS_H_
