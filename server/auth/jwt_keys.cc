#include "server/auth/jwt_keys.h"

#include <openssl/bn.h>
#include <openssl/core_names.h>
#include <openssl/ecdsa.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/param_build.h>
#include <openssl/rsa.h>
#include <openssl/x509.h>

#include <algorithm>
#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/auth/jose_text.h"
#include "server/auth/openssl_owned.h"

namespace vantage::auth {
namespace {

using nlohmann::json;

constexpr int kMinRsaBits = 2048;
constexpr int kMaxRsaBits = 8192;        // what checking costs grows with the square
constexpr size_t kMaxExponentBytes = 4;  // the same
constexpr size_t kMaxKeys = 64;
constexpr size_t kMaxKeyId = 256;
constexpr size_t kEd25519Bytes = 32;

using Number = std::unique_ptr<BIGNUM, FreedBy<BN_free>>;
using ParamBuilder = std::unique_ptr<OSSL_PARAM_BLD, FreedBy<OSSL_PARAM_BLD_free>>;
using Params = std::unique_ptr<OSSL_PARAM, FreedBy<OSSL_PARAM_free>>;
using KeyContext = std::unique_ptr<EVP_PKEY_CTX, FreedBy<EVP_PKEY_CTX_free>>;
using DigestContext = std::unique_ptr<EVP_MD_CTX, FreedBy<EVP_MD_CTX_free>>;
using EcSignature = std::unique_ptr<ECDSA_SIG, FreedBy<ECDSA_SIG_free>>;
using PublicKey = std::shared_ptr<EVP_PKEY>;

// What a kind of key can sign with; the first is meant where the key doesn't say.
struct Algorithm {
  const char* name;
  const EVP_MD* (*digest)();  // null: the algorithm has its own
  bool pss = false;
  size_t half = 0;  // bytes of each half of an ECDSA signature
};
constexpr std::array<Algorithm, 6> kRsa = {{{"RS256", EVP_sha256},
                                            {"RS384", EVP_sha384},
                                            {"RS512", EVP_sha512},
                                            {"PS256", EVP_sha256, true},
                                            {"PS384", EVP_sha384, true},
                                            {"PS512", EVP_sha512, true}}};
constexpr std::array<Algorithm, 1> kP256 = {{{"ES256", EVP_sha256, false, 32}}};
constexpr std::array<Algorithm, 1> kP384 = {{{"ES384", EVP_sha384, false, 48}}};
constexpr std::array<Algorithm, 2> kEd25519 = {{{"EdDSA", nullptr}, {"Ed25519", nullptr}}};

const Algorithm* FindAlgorithm(absl::string_view name) {
  const Algorithm* found = nullptr;
  const auto look = [&](const auto& some) {
    for (const Algorithm& one : some) {
      if (name == one.name) found = &one;
    }
  };
  look(kRsa);
  look(kP256);
  look(kP384);
  look(kEd25519);
  return found;
}

const unsigned char* Bytes(absl::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());  // NOLINT: bytes
}

// ECDSA signatures are two numbers one after the other in a token (RFC 7518 section 3.4), and DER
// in OpenSSL; empty: it is none.
std::string DerOf(absl::string_view signature, size_t half) {
  if (signature.size() != 2 * half) return "";
  EcSignature pair(ECDSA_SIG_new());
  Number r(BN_bin2bn(Bytes(signature), static_cast<int>(half), nullptr));
  Number s(BN_bin2bn(Bytes(signature) + half, static_cast<int>(half), nullptr));
  if (pair == nullptr || r == nullptr || s == nullptr) return "";
  if (ECDSA_SIG_set0(pair.get(), r.get(), s.get()) != 1) return "";
  static_cast<void>(r.release());
  static_cast<void>(s.release());
  unsigned char* der = nullptr;
  const int size = i2d_ECDSA_SIG(pair.get(), &der);
  if (size <= 0) return "";
  std::string text(reinterpret_cast<const char*>(der), static_cast<size_t>(size));  // NOLINT: bytes
  OPENSSL_free(der);
  return text;
}

// The key of parameters that `add` gives; null: they are none.
template <typename Add>
PublicKey MakeKey(const char* kind, const Add& add) {
  const ParamBuilder builder(OSSL_PARAM_BLD_new());
  if (builder == nullptr || !add(builder.get())) return nullptr;
  const Params params(OSSL_PARAM_BLD_to_param(builder.get()));
  const KeyContext context(EVP_PKEY_CTX_new_from_name(nullptr, kind, nullptr));
  EVP_PKEY* made = nullptr;
  if (params == nullptr || context == nullptr || EVP_PKEY_fromdata_init(context.get()) != 1 ||
      EVP_PKEY_fromdata(context.get(), &made, EVP_PKEY_PUBLIC_KEY, params.get()) != 1) {
    return nullptr;
  }
  return {made, EVP_PKEY_free};
}

absl::Status NoKey(absl::string_view why) { return absl::InvalidArgumentError(why); }

// The bytes of a member in base64url.
absl::StatusOr<std::string> BytesMember(const json& jwk, const char* name) {
  const std::optional<std::string> text = StringMember(jwk, name);
  std::optional<std::string> bytes = text.has_value() ? DecodeBase64Url(*text) : std::nullopt;
  if (bytes.has_value() && !bytes->empty()) return *std::move(bytes);
  return NoKey(absl::StrCat("'", name, "' is missing, or is no base64url"));
}

absl::StatusOr<PublicKey> RsaKey(const json& jwk) {
  const absl::StatusOr<std::string> modulus = BytesMember(jwk, "n");
  if (!modulus.ok()) return modulus.status();
  const absl::StatusOr<std::string> exponent = BytesMember(jwk, "e");
  if (!exponent.ok()) return exponent.status();
  if (exponent->size() > kMaxExponentBytes) return NoKey("'e' is larger than 32 bits");
  if (modulus->size() > kMaxRsaBits / 8 + 1) return NoKey("RSA keys of 8192 bits at most are used");
  const Number n(BN_bin2bn(Bytes(*modulus), static_cast<int>(modulus->size()), nullptr));
  const Number e(BN_bin2bn(Bytes(*exponent), static_cast<int>(exponent->size()), nullptr));
  if (n == nullptr || e == nullptr) return NoKey("'n' or 'e' is no number");
  const int bits = BN_num_bits(n.get());
  if (bits < kMinRsaBits) {
    return NoKey(absl::StrCat("an RSA key of ", bits, " bits is too weak: 2048 at least"));
  }
  if (bits > kMaxRsaBits) return NoKey("RSA keys of 8192 bits at most are used");
  if (BN_is_odd(n.get()) == 0 || BN_is_odd(e.get()) == 0 || BN_is_one(e.get()) != 0) {
    return NoKey("'n' and 'e' are no RSA key");
  }
  return MakeKey("RSA", [&](OSSL_PARAM_BLD* builder) {
    return OSSL_PARAM_BLD_push_BN(builder, OSSL_PKEY_PARAM_RSA_N, n.get()) == 1 &&
           OSSL_PARAM_BLD_push_BN(builder, OSSL_PKEY_PARAM_RSA_E, e.get()) == 1;
  });
}

absl::StatusOr<PublicKey> EcKey(const json& jwk, const char* group, size_t half) {
  const absl::StatusOr<std::string> x = BytesMember(jwk, "x");
  if (!x.ok()) return x.status();
  const absl::StatusOr<std::string> y = BytesMember(jwk, "y");
  if (!y.ok()) return y.status();
  if (x->size() != half || y->size() != half) return NoKey("'x' and 'y' are no point of the curve");
  const std::string point = absl::StrCat("\x04", *x, *y);
  return MakeKey("EC", [&](OSSL_PARAM_BLD* builder) {
    return OSSL_PARAM_BLD_push_utf8_string(builder, OSSL_PKEY_PARAM_GROUP_NAME, group, 0) == 1 &&
           OSSL_PARAM_BLD_push_octet_string(builder, OSSL_PKEY_PARAM_PUB_KEY, point.data(),
                                            point.size()) == 1;
  });
}

absl::StatusOr<PublicKey> EdwardsKey(const json& jwk) {
  const absl::StatusOr<std::string> x = BytesMember(jwk, "x");
  if (!x.ok()) return x.status();
  if (x->size() != kEd25519Bytes) return NoKey("'x' is no key of Ed25519");
  return PublicKey(EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, Bytes(*x), x->size()),
                   EVP_PKEY_free);
}

// Whether a key says that it is for something else than checking signatures.
bool IsForOtherThings(const json& jwk) {
  if (const auto use = jwk.find("use"); use != jwk.end() && *use != "sig") return true;
  const auto operations = jwk.find("key_ops");
  return operations != jwk.end() &&
         (!operations->is_array() ||
          std::find(operations->begin(), operations->end(), "verify") == operations->end());
}

// A key and what it may sign with; no algorithms: it is of a kind that is not known.
struct ReadKey {
  PublicKey key;
  std::vector<Algorithm> algorithms;
};

absl::StatusOr<ReadKey> ReadPublicKey(const json& jwk) {
  const std::string kind = StringMember(jwk, "kty").value_or("");
  const std::string curve = StringMember(jwk, "crv").value_or("");
  absl::StatusOr<PublicKey> key = PublicKey();
  std::vector<Algorithm> algorithms;
  if (kind == "RSA") {
    algorithms.assign(kRsa.begin(), kRsa.end());
    key = RsaKey(jwk);
  } else if (kind == "EC" && curve == "P-256") {
    algorithms.assign(kP256.begin(), kP256.end());
    key = EcKey(jwk, "P-256", kP256[0].half);
  } else if (kind == "EC" && curve == "P-384") {
    algorithms.assign(kP384.begin(), kP384.end());
    key = EcKey(jwk, "P-384", kP384[0].half);
  } else if (kind == "OKP" && curve == "Ed25519") {
    algorithms.assign(kEd25519.begin(), kEd25519.end());
    key = EdwardsKey(jwk);
  } else {
    return ReadKey{};
  }
  if (!key.ok()) return key.status();
  if (*key == nullptr) return NoKey("its values are no key");
  const KeyContext context(EVP_PKEY_CTX_new_from_pkey(nullptr, key->get(), nullptr));
  if (context == nullptr || EVP_PKEY_public_check_quick(context.get()) != 1) {
    return NoKey("its values are no key");
  }
  return ReadKey{*std::move(key), std::move(algorithms)};
}

// The key of a member of the set; nullopt: it is not for checking signatures, or of a kind that is
// not known.
absl::StatusOr<std::optional<JwtKey>> ReadJwk(const json& jwk) {
  if (!jwk.is_object()) return NoKey("it is no JSON object");
  const auto kind = jwk.find("kty");
  if (kind == jwk.end() || !kind->is_string()) return NoKey("'kty' is missing");
  if (*kind == "oct") {
    return NoKey(
        "a symmetric key ('oct') makes tokens as well as it checks them: use a key pair, and "
        "give the public key");
  }
  if (jwk.contains("d")) {
    return NoKey("it is a private key, which makes tokens: give the public key alone");
  }
  if (IsForOtherThings(jwk)) return std::nullopt;
  absl::StatusOr<ReadKey> read = ReadPublicKey(jwk);
  if (!read.ok()) return read.status();
  if (read->algorithms.empty()) return std::nullopt;
  JwtKey key;
  key.key = std::move(read->key);
  key.algorithm = read->algorithms.front().name;
  if (const auto named = jwk.find("alg"); named != jwk.end()) {
    const auto is_named = [&](const Algorithm& one) { return *named == one.name; };
    const auto found = std::find_if(read->algorithms.begin(), read->algorithms.end(), is_named);
    if (found == read->algorithms.end()) return std::nullopt;
    key.algorithm = found->name;
  }
  if (const auto id = jwk.find("kid"); id != jwk.end()) {
    if (!id->is_string()) return NoKey("'kid' is no string");
    key.id = id->get<std::string>();
    if (key.id.empty() || key.id.size() > kMaxKeyId) return NoKey("'kid' must have 1 to 256 bytes");
  }
  unsigned char* der = nullptr;
  const int size = i2d_PUBKEY(key.key.get(), &der);
  if (size <= 0) return NoKey("its values are no key");
  key.thumbprint = bytes::Sha256::Of(absl::StrCat(
      key.algorithm, " ",
      absl::string_view(reinterpret_cast<const char*>(der), static_cast<size_t>(size))));  // NOLINT
  OPENSSL_free(der);
  return key;
}

}  // namespace

bool JwtKey::Signed(absl::string_view text, absl::string_view signature) const {
  const Algorithm* known = FindAlgorithm(algorithm);
  if (known == nullptr) return false;
  const std::string der = known->half > 0 ? DerOf(signature, known->half) : "";
  if (known->half > 0) signature = der;
  const DigestContext context(EVP_MD_CTX_new());
  EVP_PKEY_CTX* parameters = nullptr;  // the context's
  bool good = !signature.empty() && context != nullptr &&
              EVP_DigestVerifyInit(context.get(), &parameters,
                                   known->digest == nullptr ? nullptr : known->digest(), nullptr,
                                   key.get()) == 1;
  if (good && known->pss) {
    good = EVP_PKEY_CTX_set_rsa_padding(parameters, RSA_PKCS1_PSS_PADDING) == 1 &&
           EVP_PKEY_CTX_set_rsa_pss_saltlen(parameters, RSA_PSS_SALTLEN_DIGEST) == 1;
  }
  good = good && EVP_DigestVerify(context.get(), Bytes(signature), signature.size(), Bytes(text),
                                  text.size()) == 1;
  ERR_clear_error();
  return good;
}

absl::StatusOr<JwtKeys> JwtKeys::Parse(absl::string_view text) {
  const json set = ParseJsonObject(text);
  if (set.is_discarded() || !set.contains("keys") || !set["keys"].is_array()) {
    return absl::InvalidArgumentError("it must be a JSON Web Key Set: {\"keys\": [...]}");
  }
  if (set["keys"].size() > kMaxKeys) {
    return absl::InvalidArgumentError(absl::StrCat("more than ", kMaxKeys, " keys"));
  }
  JwtKeys read;
  int place = 0;
  for (const json& jwk : set["keys"]) {
    ++place;
    absl::StatusOr<std::optional<JwtKey>> key = ReadJwk(jwk);
    ERR_clear_error();
    if (!key.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("key ", place, ": ", key.status().message()));
    }
    if (!key->has_value()) continue;
    const auto same = [&](const JwtKey& other) { return other.id == (*key)->id; };
    if (std::any_of(read.keys_.begin(), read.keys_.end(), same)) {
      return absl::InvalidArgumentError(
          absl::StrCat("key ", place, ": an earlier key has the same 'kid', or none either"));
    }
    read.keys_.push_back(**std::move(key));
  }
  if (read.keys_.empty()) {
    return absl::InvalidArgumentError(
        "none of its keys checks signatures by RSA, P-256, P-384 or Ed25519");
  }
  const auto nameless = [](const JwtKey& key) { return key.id.empty(); };
  if (read.size() > 1 && std::any_of(read.keys_.begin(), read.keys_.end(), nameless)) {
    return absl::InvalidArgumentError("where there are several keys, each needs a 'kid'");
  }
  return read;
}

const JwtKey* JwtKeys::Find(const std::optional<std::string>& id) const {
  if (!id.has_value()) return keys_.size() == 1 ? &keys_.front() : nullptr;
  if (id->empty()) return nullptr;
  for (const JwtKey& key : keys_) {
    if (key.id == *id) return &key;
  }
  return nullptr;
}

bool JwtKeys::Has(const std::string& thumbprint) const {
  return std::any_of(keys_.begin(), keys_.end(),
                     [&](const JwtKey& key) { return key.thumbprint == thumbprint; });
}

}  // namespace vantage::auth
