// Checks certificates and keys on disk before the server relies on them.
#ifndef VANTAGE_SERVER_AUTH_TLS_FILES_H_
#define VANTAGE_SERVER_AUTH_TLS_FILES_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"

namespace vantage::auth {

// Finds faults that gRPC would only notice when a client connects. INVALID_ARGUMENT names the file:
// it cannot be read, is no PEM, the key is not the certificate's, or the certificate has expired.
// Returns the time at which it will expire.
absl::StatusOr<absl::Time> CheckTlsFiles(const AccessOptions& options);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_TLS_FILES_H_
