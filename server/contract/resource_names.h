// Resource names: sessions/{session}, sessions/{session}/scans/{scan}, ...
#ifndef VANTAGE_SERVER_CONTRACT_RESOURCE_NAMES_H_
#define VANTAGE_SERVER_CONTRACT_RESOURCE_NAMES_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::contract {

// 1 to 63 of [a-z0-9-], starting with a letter, not ending in '-'.
bool IsValidId(absl::string_view id);

std::string NameOfSession(absl::string_view session);
// `collection` is 'scans', 'uploads', 'plans', 'rejections', ...
std::string ChildName(absl::string_view session, absl::string_view collection,
                      absl::string_view id);

// The id in 'sessions/{id}'. INVALID_ARGUMENT naming `field`.
absl::StatusOr<std::string> ParseSessionName(absl::string_view name, absl::string_view field);

struct ChildId {
  std::string session;
  std::string id;
};
// The ids in 'sessions/{session}/{collection}/{id}'. INVALID_ARGUMENT naming `field`.
absl::StatusOr<ChildId> ParseChildName(absl::string_view name, absl::string_view collection,
                                       absl::string_view field);

// The number at the end of a name that the server chose, such as '.../claims/claim-3'; 0: it has
// none.
int64_t NumberOf(absl::string_view name);

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_RESOURCE_NAMES_H_
