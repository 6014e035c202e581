#include "server/contract/resource_names.h"

#include <algorithm>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/contract/error.h"

namespace vantage::contract {

bool IsValidId(absl::string_view id) {
  return !id.empty() && id.size() <= 63 && absl::ascii_islower(id.front()) && id.back() != '-' &&
         std::all_of(id.begin(), id.end(), [](char c) {
           return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-';
         });
}

std::string NameOfSession(absl::string_view session) { return absl::StrCat("sessions/", session); }

std::string ChildName(absl::string_view session, absl::string_view collection,
                      absl::string_view id) {
  return absl::StrCat("sessions/", session, "/", collection, "/", id);
}

absl::StatusOr<std::string> ParseSessionName(absl::string_view name, absl::string_view field) {
  const std::vector<absl::string_view> parts = absl::StrSplit(name, '/');
  if (parts.size() != 2 || parts[0] != "sessions" || !IsValidId(parts[1])) {
    return InvalidField(field, "must be of the form sessions/{session}");
  }
  return std::string(parts[1]);
}

absl::StatusOr<ChildId> ParseChildName(absl::string_view name, absl::string_view collection,
                                       absl::string_view field) {
  const std::vector<absl::string_view> parts = absl::StrSplit(name, '/');
  if (parts.size() != 4 || parts[0] != "sessions" || !IsValidId(parts[1]) ||
      parts[2] != collection || !IsValidId(parts[3])) {
    return InvalidField(
        field, absl::StrCat("must be of the form sessions/{session}/", collection, "/{id}"));
  }
  return ChildId{std::string(parts[1]), std::string(parts[3])};
}

int64_t NumberOf(absl::string_view name) {
  int64_t number = 0;
  const size_t dash = name.rfind('-');
  if (dash == absl::string_view::npos) return 0;
  return absl::SimpleAtoi(name.substr(dash + 1), &number) && number > 0 ? number : 0;
}

}  // namespace vantage::contract
