// Certificates and keys on disk, looked at before anyone relies on them.
#ifndef VANTAGE_SERVER_AUTH_TLS_FILES_H_
#define VANTAGE_SERVER_AUTH_TLS_FILES_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"

namespace vantage::auth {

// What gRPC would only notice when somebody connects. INVALID_ARGUMENT naming the file: it cannot
// be read, is no PEM, the key is not the certificate's, the certificate has expired. Returns when
// it will.
absl::StatusOr<absl::Time> CheckTlsFiles(const AccessOptions& options);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_TLS_FILES_H_
