// What tokens and keys of the JOSE family are written in: base64url and JSON, read to the letter.
// Readers that mend what they get are how two programs come to see two things in one token.
#ifndef VANTAGE_SERVER_AUTH_JOSE_TEXT_H_
#define VANTAGE_SERVER_AUTH_JOSE_TEXT_H_

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "absl/strings/string_view.h"

namespace vantage::auth {

// base64url without padding (RFC 7515 section 2); nullopt: it is none, or another text would stand
// for the same bytes.
std::optional<std::string> DecodeBase64Url(absl::string_view text);

// The JSON object that `text` is; discarded (is_discarded()) where it is none, where an object in
// it has a member twice, or where it is deeper than 8.
nlohmann::json ParseJsonObject(absl::string_view text);

// A member that is a string; nullopt: there is none, or it is something else.
std::optional<std::string> StringMember(const nlohmann::json& object, const char* name);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_JOSE_TEXT_H_
