#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "server/auth/jwt.h"

namespace {

constexpr char kKeys[] =
    R"({"keys":[{"kty":"EC","crv":"P-256","x":"f83OJ3D2xF1Bg8vub9tLe1gHMzV76e8Tus9uPHvRVEU",)"
    R"("y":"x_FEzRu9m36HLN_tue659LNpXW6pCyStikYjKIWI5a0"}]})";

}  // namespace

// A key set is read or refused; whatever a token's text or its parts are, nobody is let in, since
// nobody has the key.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  namespace auth = vantage::auth;
  const absl::string_view text(reinterpret_cast<const char*>(data), size);  // NOLINT: bytes
  const auto read = auth::JwtKeys::Parse(text);
  if (!read.ok() && !absl::IsInvalidArgument(read.status())) std::abort();
  static const auth::JwtKeys keys = auth::JwtKeys::Parse(kKeys).value();
  auth::JwtOptions options;
  options.issuer = "i";
  options.audience = "a";
  const size_t half = text.find('\n');
  const std::string parts = absl::StrCat(
      absl::WebSafeBase64Escape(text.substr(0, half)), ".",
      absl::WebSafeBase64Escape(half == absl::string_view::npos ? "" : text.substr(half + 1)), ".",
      absl::WebSafeBase64Escape(std::string(64, 'x')));
  for (const absl::string_view token : {text, absl::string_view(parts)}) {
    auth::HasFormOfJwt(token);
    const auto caller = auth::CheckJwt(token, keys, options, absl::FromUnixSeconds(1'800'000'000));
    if (!absl::IsUnauthenticated(caller.status())) std::abort();
  }
  return 0;
}
