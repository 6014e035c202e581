// Asks a server whether it serves, for health checks of containers without extra tools.
#ifndef VANTAGE_SERVER_MAIN_HEALTHCHECK_H_
#define VANTAGE_SERVER_MAIN_HEALTHCHECK_H_

#include <string>

#include "absl/status/status.h"

namespace vantage::server {

// OK when the server at `address` says SERVING within 3 s. UNAVAILABLE otherwise, with the reason.
absl::Status CheckHealth(const std::string& address);

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_HEALTHCHECK_H_
