// How a client identifies itself and authenticates the server.
#ifndef VANTAGE_CLIENT_LIBRARY_CREDENTIALS_H_
#define VANTAGE_CLIENT_LIBRARY_CREDENTIALS_H_

#include <grpcpp/client_context.h>
#include <grpcpp/security/credentials.h>

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client_options.h"

namespace vantage::client {

// INVALID_ARGUMENT or NOT_FOUND: options that don't fit together, files that cannot be read, a
// token that would travel in the clear.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeChannelCredentials(
    const ClientOptions& options);

// Adds the token, where there is one, to a call.
absl::Status AddToken(const ClientOptions& options, grpc::ClientContext& context);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_CREDENTIALS_H_
