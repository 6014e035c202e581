// Certificates and keys on disk, looked at before anyone relies on them.
#ifndef VANTAGE_SERVER_GUARD_TLS_FILES_H_
#define VANTAGE_SERVER_GUARD_TLS_FILES_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/guard/access_options.h"

namespace vantage {

// What gRPC would only notice when somebody connects. INVALID_ARGUMENT naming the file: it cannot
// be read, is no PEM, the key is not the certificate's, the certificate has expired. Returns when
// it will.
absl::StatusOr<absl::Time> CheckTlsFiles(const AccessOptions& options);

}  // namespace vantage

#endif  // VANTAGE_SERVER_GUARD_TLS_FILES_H_
