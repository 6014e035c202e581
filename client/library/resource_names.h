// Names of the service's resources, and their short forms.
#ifndef VANTAGE_CLIENT_LIBRARY_RESOURCE_NAMES_H_
#define VANTAGE_CLIENT_LIBRARY_RESOURCE_NAMES_H_

#include <string>

#include "absl/strings/string_view.h"

namespace vantage::client {

// 'sessions/a' for 'a' and 'sessions/a'.
std::string SessionName(absl::string_view given);
// 'sessions/a/scans/b' for 'a/b' and the full name; likewise for claims and
// stations.
std::string ScanName(absl::string_view given);
std::string ClaimName(absl::string_view given);
std::string StationName(absl::string_view given);
std::string UploadName(absl::string_view given);
std::string RejectionName(absl::string_view given);
std::string PlanName(absl::string_view given);
// 'sessions/a/scanners/b' for 'b' and the full name, in session 'a' or 'sessions/a'.
std::string ScannerName(absl::string_view session, absl::string_view given);
// The session that a scan or plan belongs to.
std::string SessionOf(absl::string_view name);
// The last part of a resource name.
std::string IdOf(absl::string_view name);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_RESOURCE_NAMES_H_
