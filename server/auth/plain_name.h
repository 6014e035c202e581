// What names of callers and tenants are made of.
#ifndef VANTAGE_SERVER_AUTH_PLAIN_NAME_H_
#define VANTAGE_SERVER_AUTH_PLAIN_NAME_H_

#include <algorithm>
#include <cstddef>

#include "absl/strings/ascii.h"
#include "absl/strings/string_view.h"

namespace vantage::auth {

// True for 1 to 63 of letters, digits and -_.@
inline bool IsPlainName(absl::string_view name) {
  constexpr size_t kMaxName = 63;
  return !name.empty() && name.size() <= kMaxName &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return absl::ascii_isalnum(c) || c == '-' || c == '_' || c == '.' || c == '@';
         });
}

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_PLAIN_NAME_H_
