#include "client/library/resource_names.h"

#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace vantage::client {
namespace {

std::string ChildName(absl::string_view given, const char* collection) {
  const std::vector<std::string> parts = absl::StrSplit(given, '/');
  if (parts.size() == 2) {
    return absl::StrCat("sessions/", parts[0], "/", collection, "/", parts[1]);
  }
  return std::string(given);
}

}  // namespace

std::string SessionName(absl::string_view given) {
  return absl::StrContains(given, '/') ? std::string(given) : absl::StrCat("sessions/", given);
}
std::string ScanName(absl::string_view given) { return ChildName(given, "scans"); }
std::string ClaimName(absl::string_view given) { return ChildName(given, "claims"); }
std::string StationName(absl::string_view given) { return ChildName(given, "stations"); }
std::string UploadName(absl::string_view given) { return ChildName(given, "uploads"); }
std::string RejectionName(absl::string_view given) { return ChildName(given, "rejections"); }
std::string PlanName(absl::string_view given) { return ChildName(given, "plans"); }

std::string ScannerName(absl::string_view session, absl::string_view given) {
  return absl::StrContains(given, '/') ? std::string(given)
                                       : absl::StrCat(SessionName(session), "/scanners/", given);
}

std::string SessionOf(absl::string_view name) {
  const std::vector<std::string> parts = absl::StrSplit(name, '/');
  return parts.size() >= 2 ? absl::StrCat(parts[0], "/", parts[1]) : std::string(name);
}

std::string IdOf(absl::string_view name) {
  const size_t slash = name.rfind('/');
  return std::string(slash == absl::string_view::npos ? name : name.substr(slash + 1));
}

}  // namespace vantage::client
