// The keys by which an identity provider's tokens are checked.
#ifndef VANTAGE_SERVER_AUTH_JWT_KEYS_H_
#define VANTAGE_SERVER_AUTH_JWT_KEYS_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <openssl/types.h>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::auth {

// A public key, and the one algorithm that it is for: what a token says of its algorithm can only
// agree or be refused.
struct JwtKey {
  std::string id;          // 'kid'; empty: the key has none, and is the only one
  std::string algorithm;   // 'RS256', 'ES256', 'EdDSA', ...
  std::string thumbprint;  // SHA-256 of key and algorithm, 32 bytes
  std::shared_ptr<EVP_PKEY> key;

  // Whether `signature` is this key's for `text`.
  bool Signed(absl::string_view text, absl::string_view signature) const;
};

// A JSON Web Key Set (RFC 7517): RSA of 2048 to 8192 bits (RS256, RS384, RS512, PS256, PS384,
// PS512; RS256 where the key doesn't say), EC on P-256 (ES256) and P-384 (ES384), Ed25519 (EdDSA).
// Keys for encryption ('use', 'key_ops') and of kinds that are not known are left out, as RFC 7517
// section 5 asks. Immutable.
class JwtKeys {
 public:
  // INVALID_ARGUMENT names the key by its place and says why, but never quotes it: no JSON, no key
  // that signs, two with one 'kid', several of which one has none, a symmetric or a private key
  // (whoever has it makes tokens), RSA of another size, values that are no key.
  static absl::StatusOr<JwtKeys> Parse(absl::string_view text);

  // The key of that id; without one the only key that there is. Null: none.
  const JwtKey* Find(const std::optional<std::string>& id) const;

  bool Has(const std::string& thumbprint) const;
  size_t size() const { return keys_.size(); }

 private:
  std::vector<JwtKey> keys_;
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_JWT_KEYS_H_
