// What a server shows before anything is asked of it: whether it can be reached, and its
// certificate.
#ifndef VANTAGE_CLIENT_CLI_TLS_PROBE_H_
#define VANTAGE_CLIENT_CLI_TLS_PROBE_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client_options.h"

namespace vantage::cli {

struct HostPort {
  std::string host;  // of unix:PATH the path
  std::string port;  // empty: a socket in the file system
};

// HOST:PORT, [HOST]:PORT or unix:PATH. INVALID_ARGUMENT: none of these.
absl::StatusOr<HostPort> ParseAddress(const std::string& server);

// The numeric addresses that a name stands for. NOT_FOUND: none, or no answer within `seconds`.
absl::StatusOr<std::vector<std::string>> Resolve(const HostPort& address, double seconds);

// Connects and hangs up. UNAVAILABLE says why not. `seconds`: patience.
absl::Status Reach(const HostPort& address, double seconds);

struct Certificate {
  std::string subject;
  std::vector<std::string> names;  // that it is for
  double days_left = 0;            // below 0: expired
  absl::Status trusted;            // by --tls-ca, and for this name; says why not
};

// Shakes hands by TLS. Nothing: whoever listens there does not speak it. Without `options.tls_ca`
// nothing is trusted. INVALID_ARGUMENT: the files of the options cannot be used. UNAVAILABLE:
// nothing answers, or what does hangs up. A program that asks ignores SIGPIPE.
absl::StatusOr<std::optional<Certificate>> ShakeHands(const HostPort& address,
                                                      const client::ClientOptions& options,
                                                      double seconds);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TLS_PROBE_H_
