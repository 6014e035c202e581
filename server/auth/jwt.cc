#include "server/auth/jwt.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "server/auth/jose_text.h"
#include "server/auth/plain_name.h"
#include "server/auth/role.h"

namespace vantage::auth {
namespace {

using nlohmann::json;

constexpr size_t kMaxToken = 8 << 10;
constexpr size_t kMaxSubject = 255;           // OpenID Connect Core, section 2
constexpr double kLastSecond = 253402300799;  // of the year 9999
constexpr char kNamePrefix[] = "jwt:";

absl::Status Unvouched() {
  return absl::UnauthenticatedError(
      "the token is none that this server's keys vouch for: get a new one from the identity "
      "provider");
}

absl::Status Unfit(absl::string_view why) { return absl::FailedPreconditionError(why); }

// A token's text, its three parts decoded.
struct Parts {
  json header;
  json claims;
  absl::string_view signed_text;
  std::string signature;
};

std::optional<Parts> TakeApart(absl::string_view token) {
  if (token.size() > kMaxToken) return std::nullopt;
  const std::vector<absl::string_view> texts = absl::StrSplit(token, '.');
  if (texts.size() != 3) return std::nullopt;
  const std::optional<std::string> header = DecodeBase64Url(texts[0]);
  const std::optional<std::string> claims = DecodeBase64Url(texts[1]);
  std::optional<std::string> signature = DecodeBase64Url(texts[2]);
  if (!header || !claims || !signature || signature->empty()) return std::nullopt;
  Parts parts{ParseJsonObject(*header), ParseJsonObject(*claims),
              token.substr(0, texts[0].size() + 1 + texts[1].size()), *std::move(signature)};
  if (parts.header.is_discarded() || parts.claims.is_discarded()) return std::nullopt;
  return parts;
}

// Tokens for other purposes, which a provider may sign with the same key, say so in 'typ'
// (RFC 8725 section 3.11); 'crit' asks for what this reader doesn't know, 'cty' says that another
// token is inside.
bool IsOfThisKind(const json& header) {
  if (header.contains("crit") || header.contains("cty")) return false;
  if (!header.contains("typ")) return true;
  std::string kind = absl::AsciiStrToLower(StringMember(header, "typ").value_or(""));
  if (absl::StartsWith(kind, "application/")) kind = kind.substr(kind.find('/') + 1);
  return kind == "jwt" || kind == "at+jwt";
}

// The key that vouches for a token; null: none.
const JwtKey* VouchingKey(const Parts& parts, const JwtKeys& keys) {
  if (!IsOfThisKind(parts.header)) return nullptr;
  const std::optional<std::string> id = StringMember(parts.header, "kid");
  if (parts.header.contains("kid") && !id.has_value()) return nullptr;
  const JwtKey* key = keys.Find(id);
  if (key == nullptr || StringMember(parts.header, "alg") != key->algorithm) return nullptr;
  return key->Signed(parts.signed_text, parts.signature) ? key : nullptr;
}

// A claim that is a time; nullopt: there is none. FAILED_PRECONDITION: it is something else.
absl::StatusOr<std::optional<absl::Time>> TimeClaim(const json& claims, const char* name) {
  const auto claim = claims.find(name);
  if (claim == claims.end()) return std::nullopt;
  const double seconds = claim->is_number() ? claim->get<double>() : -1;
  if (!(seconds >= 0 && seconds <= kLastSecond)) {
    return Unfit(absl::StrCat("the token's claim '", name, "' is no time"));
  }
  return absl::UnixEpoch() + absl::Seconds(seconds);
}

absl::Status CheckAddressee(const json& claims, const JwtOptions& options) {
  if (StringMember(claims, "iss") != options.issuer) {
    return Unfit(absl::StrCat("the token's claim 'iss' is not '", options.issuer,
                              "', whose tokens this server takes"));
  }
  const auto audience = claims.find("aud");
  const bool one = audience != claims.end() && *audience == options.audience;
  const bool among =
      audience != claims.end() && audience->is_array() &&
      std::find(audience->begin(), audience->end(), options.audience) != audience->end();
  if (one || among) return absl::OkStatus();
  return Unfit(
      absl::StrCat("the token's claim 'aud' does not name this server: ask the identity "
                   "provider for a token with the audience '",
                   options.audience, "'"));
}

// When the token expires.
absl::StatusOr<absl::Time> CheckTimes(const json& claims, absl::Time now) {
  for (const char* name : {"nbf", "iat"}) {
    const absl::StatusOr<std::optional<absl::Time>> begin = TimeClaim(claims, name);
    if (!begin.ok()) return begin.status();
    if (begin->has_value() && **begin > now + kJwtLeeway) {
      return Unfit(absl::StrCat("the token is not good yet by its claim '", name,
                                "': is the clock of whoever made it right?"));
    }
  }
  const absl::StatusOr<std::optional<absl::Time>> end = TimeClaim(claims, "exp");
  if (!end.ok()) return end.status();
  if (!end->has_value()) {
    return Unfit("the token's claim 'exp' is missing: one that never expires is not taken");
  }
  return **end;
}

absl::StatusOr<std::string> SubjectOf(const json& claims) {
  const std::string subject = StringMember(claims, "sub").value_or("");
  if (subject.empty() || subject.size() > kMaxSubject ||
      !std::all_of(subject.begin(), subject.end(), absl::ascii_isgraph)) {
    return Unfit("the token's claim 'sub' must be 1 to 255 ASCII characters without spaces");
  }
  return subject;
}

// Whatever else is among the values belongs to other services.
absl::StatusOr<Roles> RolesOf(const json& claims, const JwtOptions& options) {
  const auto claim = claims.find(options.roles_claim);
  std::vector<std::string> values;
  if (claim != claims.end() && claim->is_string()) {
    values = absl::StrSplit(claim->get<std::string>(), ' ', absl::SkipEmpty());
  } else if (claim != claims.end() && claim->is_array()) {
    for (const json& value : *claim) {
      if (value.is_string()) values.push_back(value.get<std::string>());
    }
  } else if (claim != claims.end()) {
    return Unfit(absl::StrCat("the token's claim '", options.roles_claim,
                              "' must be an array of strings, or a string with spaces between"));
  }
  Roles roles;
  for (absl::string_view value : values) {
    if (!absl::ConsumePrefix(&value, options.role_prefix)) continue;
    for (const Role role : {Role::kRead, Role::kSubmit, Role::kPlan, Role::kAdminister}) {
      if (value == RoleName(role)) roles = roles.With(role);
    }
  }
  return roles;
}

absl::StatusOr<Caller> CallerOf(const json& claims, const JwtOptions& options, absl::Time now) {
  if (absl::Status here = CheckAddressee(claims, options); !here.ok()) return here;
  const absl::StatusOr<absl::Time> expires = CheckTimes(claims, now);
  if (!expires.ok()) return expires.status();
  const absl::StatusOr<std::string> subject = SubjectOf(claims);
  if (!subject.ok()) return subject.status();
  const std::string tenant = StringMember(claims, options.tenant_claim.c_str()).value_or("");
  if (!IsPlainName(tenant) || tenant == "-") {
    return Unfit(absl::StrCat("the token's claim '", options.tenant_claim,
                              "' must name a tenant: 1 to 63 of letters, digits and -_.@"));
  }
  const absl::StatusOr<Roles> roles = RolesOf(claims, options);
  if (!roles.ok()) return roles.status();
  Caller caller;
  caller.name = absl::StrCat(kNamePrefix, *subject);
  caller.tenant = tenant;
  caller.roles = *roles;
  caller.expires = *expires;
  caller.by_jwt = true;
  return caller;
}

}  // namespace

bool HasFormOfJwt(absl::string_view token) {
  const auto is_base64url = [](char c) {
    return absl::ascii_isalnum(c) || c == '-' || c == '_' || c == '.';
  };
  return std::count(token.begin(), token.end(), '.') == 2 &&
         std::all_of(token.begin(), token.end(), is_base64url);
}

absl::StatusOr<Caller> CheckJwt(absl::string_view token, const JwtKeys& keys,
                                const JwtOptions& options, absl::Time now) {
  const std::optional<Parts> parts = TakeApart(token);
  if (!parts.has_value()) return Unvouched();
  const JwtKey* key = VouchingKey(*parts, keys);
  if (key == nullptr) return Unvouched();
  absl::StatusOr<Caller> caller = CallerOf(parts->claims, options, now);
  if (caller.ok()) caller->credential = key->thumbprint;
  return caller;
}

}  // namespace vantage::auth
