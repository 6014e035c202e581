// Whom a signed token makes of its bearer, and which tokens make nobody.
#include "server/auth/jwt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/hmac.h>

#include <cctype>
#include <jwt/jwt.hpp>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "tests/server/fixture/jwt_signer.h"

namespace vantage::auth {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const absl::Time kNow = absl::FromUnixSeconds(1'800'000'000);

JwtOptions Site() {
  JwtOptions options;
  options.issuer = "https://login.example";
  options.audience = "vantage";
  return options;
}

constexpr char kClaims[] =
    R"({"iss":"https://login.example","aud":"vantage","sub":"anna","tenant":"museum",)"
    R"("roles":["plan","read"],"exp":1800000100})";

std::string With(const std::string& old, const std::string& instead) {
  std::string changed = absl::StrReplaceAll(kClaims, {{old, instead}});
  EXPECT_NE(changed, kClaims) << old;
  return changed;
}

JwtKeys KeysOf(const std::string& set) {
  absl::StatusOr<JwtKeys> keys = JwtKeys::Parse(set);
  EXPECT_TRUE(keys.ok()) << keys.status();
  return *std::move(keys);
}

absl::StatusOr<Caller> Check(const std::string& token, const JwtKeys& keys,
                             const JwtOptions& options = Site()) {
  return CheckJwt(token, keys, options, kNow);
}

const fixture::JwtSigner& Rsa() {
  static const fixture::JwtSigner signer("RSA-2048", "rsa");
  return signer;
}

// ---- What others signed ------------------------------------------------------------------------

struct Vector {
  const char* what;
  const char* key;
  const char* token;
};
constexpr char kJoe[] =
    "eyJpc3MiOiJqb2UiLA0KICJleHAiOjEzMDA4MTkzODAsDQogImh0dHA6Ly9leGFtcGxlLmNvbS9pc19yb290Ijp0cnVlf"
    "Q";
const Vector kVectors[] = {
    {"RFC 7515 A.2",
     R"({"kty":"RSA","n":"ofgWCuLjybRlzo0tZWJjNiuSfb4p4fAkd_wWJcyQoTbji9k0l8W26mPddxHmfHQp-Vaw-4qPCJ)"
     R"(rcS2mJPMEzP1Pt0Bm4d4QlL-yRT-SFd2lZS-pCgNMsD1W_YpRPEwOWvG6b32690r2jZ47soMZo9wGzjb_7OMg0LOL-bSf)"
     R"(63kpaSHSXndS5z5rexMdbBYUsLA9e-KXBdQOS-UTo7WTBEMa2R2CapHg665xsmtdVMTBQY4uDZlxvb3qCo5ZwKh9kG4LT6)"
     R"(_I5IhlJH7aGhyxXFvUK-DWNmoudF8NAco9_h9iaGNj8q2ethFkMLs91kzk2PAcDTW9gb54h4FRWyuXpoQ","e":"AQAB"})",
     "eyJhbGciOiJSUzI1NiJ9.*.cC4hiUPoj9Eetdgtv3hF80EGrhuB__"
     "dzERat0XF9g2VtQgr9PJbu3XOiZj5RZmh7AAuHIm4"
     "Bh-0Qc_lF5YKt_O8W2Fp5jujGbds9uJdbF9CUAr7t1dnZcAcQjbKBYNX4BAynRFdiuB--f_"
     "nZLgrnbyTyWzO75vRK5h6xB"
     "ArLIARNPvkSjtQBMHlb1L07Qe7K0GarZRmB_eSN9383LcOLn6_dO--xi12jzDwusC-"
     "eOkHWEsqtFZESc6BfI7noOPqvhJ1"
     "phCnvWh6IeYI2w9QOYEUipUTI8np6LbgGY9Fs98rqVt5AXLIhWkWywlVmtVrBp0igcN_IoypGlUPQGe77Rw"},
    {"RFC 7515 A.3",
     R"({"kty":"EC","crv":"P-256","x":"f83OJ3D2xF1Bg8vub9tLe1gHMzV76e8Tus9uPHvRVEU",)"
     R"("y":"x_FEzRu9m36HLN_tue659LNpXW6pCyStikYjKIWI5a0"})",
     "eyJhbGciOiJFUzI1NiJ9.*.DtEhU3ljbEg8L38VWAfUAqOyKAM6-Xx-"
     "F4GawxaepmXFCgfTjDxw5djxLa8ISlSApmWQxfK"
     "TUJqPP3-Kg6NU1Q"},
    {"RFC 8037 A.4",
     R"({"kty":"OKP","crv":"Ed25519","x":"11qYAYKxCrfVS_7TyWQHOg7hcvPapiMlrwIaaPcHURo"})",
     "eyJhbGciOiJFZERTQSJ9.RXhhbXBsZSBvZiBFZDI1NTE5IHNpZ25pbmc.hgyY0il_MGCjP0JzlnLWG1PPOt7-"
     "09PGcvMg3"
     "AIbQR6dWbhijcNR4ki4iylGjg5BhVsPt9g7sVvpAr_MuM0KAg"},
};

TEST(JwtKey, ChecksTheSignaturesThatTheStandardsPrint) {
  for (const Vector& vector : kVectors) {
    const JwtKeys keys = KeysOf(absl::StrCat("{\"keys\":[", vector.key, "]}"));
    const JwtKey* key = keys.Find(std::nullopt);
    ASSERT_NE(key, nullptr) << vector.what;
    const std::string token = absl::StrReplaceAll(vector.token, {{"*", kJoe}});
    const size_t end = token.rfind('.');
    const std::string text = token.substr(0, end);
    std::string signature;
    ASSERT_TRUE(absl::WebSafeBase64Unescape(token.substr(end + 1), &signature)) << vector.what;
    EXPECT_TRUE(key->Signed(text, signature)) << vector.what;
    EXPECT_FALSE(key->Signed(text + "A", signature)) << vector.what;
    for (size_t at = 0; at < signature.size(); ++at) {
      std::string other = signature;
      other[at] = static_cast<char>(other[at] ^ 1);
      EXPECT_FALSE(key->Signed(text, other)) << vector.what << " byte " << at;
    }
    EXPECT_FALSE(key->Signed(text, signature.substr(1))) << vector.what;
    EXPECT_FALSE(key->Signed(text, "")) << vector.what;
  }
}

// Joe's token is genuine: what it lacks is said by the claim, and never read out of an unsigned
// one.
TEST(CheckJwt, ReadsAStandardsTokenAsFarAsItGoes) {
  const JwtKeys keys = KeysOf(absl::StrCat("{\"keys\":[", kVectors[0].key, "]}"));
  const std::string token = absl::StrReplaceAll(kVectors[0].token, {{"*", kJoe}});
  EXPECT_TRUE(absl::IsFailedPrecondition(Check(token, keys).status()));
  JwtOptions joes = Site();
  joes.issuer = "joe";
  EXPECT_THAT(std::string(Check(token, keys, joes).status().message()), HasSubstr("'aud'"));
  // RFC 7515 A.1 (HS256) and A.5 (none).
  for (const char* other :
       {"eyJ0eXAiOiJKV1QiLA0KICJhbGciOiJIUzI1NiJ9.*.dBjftJeZ4CVP-mB92K27uhbUJU1p1r_wW1gFWFOEjXk",
        "eyJhbGciOiJub25lIn0.*."}) {
    EXPECT_TRUE(
        absl::IsUnauthenticated(Check(absl::StrReplaceAll(other, {{"*", kJoe}}), keys).status()))
        << other;
  }
}

// Another implementation signs, whose tokens are read here.
TEST(CheckJwt, TakesWhatAnotherLibrarySigns) {
  for (const char* kind : {"RSA-2048", "P-256", "P-384"}) {
    const fixture::JwtSigner signer(kind, "k");
    const JwtKeys keys = KeysOf(signer.KeySet());
    namespace params = jwt::params;
    jwt::jwt_object object{params::algorithm(signer.algorithm()),
                           params::secret(signer.private_pem())};
    object.header().add_header("kid", "k");
    object.add_claim("iss", "https://login.example")
        .add_claim("aud", std::vector<std::string>{"other", "vantage"})
        .add_claim("sub", "anna")
        .add_claim("tenant", "museum")
        .add_claim("roles", std::vector<std::string>{"administer"})
        .add_claim("exp", 1'800'000'100);
    const absl::StatusOr<Caller> caller = Check(object.signature(), keys);
    ASSERT_TRUE(caller.ok()) << kind << ": " << caller.status();
    EXPECT_EQ(caller->name, "jwt:anna");
    EXPECT_TRUE(caller->roles.Allow(Role::kAdminister));
    // And the other way round.
    std::error_code wrong;
    jwt::decode(signer.Token(kClaims), params::algorithms({signer.algorithm()}), wrong,
                params::secret(signer.public_pem()), params::verify(false));
    EXPECT_FALSE(wrong) << kind << ": " << wrong.message();
  }
}

// ---- Who it is ---------------------------------------------------------------------------------

TEST(CheckJwt, MakesACallerOfTheClaims) {
  for (const char* kind : {"RSA-2048", "RSA-3072", "P-256", "P-384", "Ed25519"}) {
    const fixture::JwtSigner signer(kind, "k");
    const JwtKeys keys = KeysOf(signer.KeySet());
    const absl::StatusOr<Caller> caller = Check(signer.Token(kClaims), keys);
    ASSERT_TRUE(caller.ok()) << kind << ": " << caller.status();
    EXPECT_EQ(caller->name, "jwt:anna");
    EXPECT_EQ(caller->tenant, "museum");
    EXPECT_FALSE(caller->names_tenant);
    EXPECT_TRUE(caller->by_jwt);
    EXPECT_TRUE(caller->roles.Allow(Role::kPlan));
    EXPECT_TRUE(caller->roles.Allow(Role::kRead));
    EXPECT_FALSE(caller->roles.Allow(Role::kSubmit));
    EXPECT_EQ(caller->expires, absl::FromUnixSeconds(1'800'000'100));
    EXPECT_TRUE(keys.Has(caller->credential));
  }
}

TEST(CheckJwt, AlgorithmsOfRsaKeysAreTheirOwn) {
  for (const char* own : {"RS256", "RS384", "RS512", "PS256", "PS384", "PS512"}) {
    const JwtKeys keys = KeysOf(Rsa().KeySet(absl::StrCat(",\"alg\":\"", own, "\"")));
    for (const char* other : {"RS256", "RS384", "RS512", "PS256", "PS384", "PS512"}) {
      const std::string header = absl::StrCat("{\"alg\":\"", other, "\",\"kid\":\"rsa\"}");
      const std::string token = Rsa().Sign(header, kClaims, other);
      EXPECT_EQ(Check(token, keys).ok(), std::string(own) == other) << own << " " << other;
    }
  }
}

TEST(CheckJwt, RolesAreFoundAmongOtherServices) {
  const JwtKeys keys = KeysOf(Rsa().KeySet());
  const auto roles = [&](const std::string& value, const std::string& prefix) {
    JwtOptions options = Site();
    options.role_prefix = prefix;
    const auto caller = Check(Rsa().Token(With(R"(["plan","read"])", value)), keys, options);
    EXPECT_TRUE(caller.ok()) << value << ": " << caller.status();
    std::string found;
    for (const Role role : {Role::kRead, Role::kSubmit, Role::kPlan}) {
      if (caller.ok() && caller->roles.Allow(role)) absl::StrAppend(&found, RoleName(role), " ");
    }
    return found;
  };
  EXPECT_EQ(roles(R"("openid read  submit")", ""), "read submit ");
  EXPECT_EQ(roles(R"(["offline",7,null,"plan"])", ""), "plan ");
  EXPECT_EQ(roles(R"(["Read","reader","plan "])", ""), "");
  EXPECT_EQ(roles(R"("read vantage:plan wiki:submit")", "vantage:"), "plan ");
  EXPECT_EQ(roles("[]", ""), "");
  JwtOptions scope = Site();
  scope.roles_claim = "scope";
  const auto without = Check(Rsa().Token(kClaims), keys, scope);
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_TRUE(without->roles.empty());
}

TEST(CheckJwt, TheClaimThatIsWrongIsNamed) {
  const JwtKeys keys = KeysOf(Rsa().KeySet());
  const std::vector<std::vector<std::string>> wrong = {
      {"'iss'", "https://login.example", "https://login.example/"},
      {"'iss'", R"("iss":"https://login.example",)", ""},
      {"'iss'", R"("https://login.example")", R"(["https://login.example"])"},
      {"'aud'", R"("vantage")", R"("vantage2")"},
      {"'aud'", R"("vantage")", R"(["other"])"},
      {"'aud'", R"("aud":"vantage",)", ""},
      {"'sub'", R"("anna")", R"("")"},
      {"'sub'", R"("anna")", "7"},
      {"'sub'", R"("anna")", R"("anna b")"},
      {"'sub'", R"("anna")", "\"" + std::string(256, 'a') + "\""},
      {"'tenant'", R"("museum")", R"("*")"},
      {"'tenant'", R"("museum")", R"("-")"},
      {"'tenant'", R"("museum")", R"("mus/eum")"},
      {"'tenant'", R"("museum")", R"(["museum"])"},
      {"'tenant'", R"("tenant":"museum",)", ""},
      {"'roles'", R"(["plan","read"])", "7"},
      {"'exp'", R"(,"exp":1800000100)", ""},
      {"'exp'", "1800000100", R"("1800000100")"},
      {"'exp'", "1800000100", "1e300"},
      {"'exp'", "1800000100", "-1"},
      {"'nbf'", R"("exp")", R"("nbf":1800000061,"exp")"},
      {"'iat'", R"("exp")", R"("iat":1800000061,"exp")"},
      {"'nbf'", R"("exp")", R"("nbf":null,"exp")"},
  };
  for (const auto& one : wrong) {
    const absl::Status status = Check(Rsa().Token(With(one[1], one[2])), keys).status();
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << one[2] << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(one[0]));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("anna")));
  }
  // Within the leeway of the clocks.
  for (const char* fine : {R"("nbf":1800000060,"exp")", R"("iat":1800000060.5e0,"exp")",
                           R"("nbf":1799999000,"exp")"}) {
    const std::string claims = With(R"("exp")", absl::StrReplaceAll(fine, {{"60.5e0", "59.5e0"}}));
    EXPECT_TRUE(Check(Rsa().Token(claims), keys).ok()) << fine;
  }
  // One that has expired is read; the end of its time is for whoever asks.
  const auto late = Check(Rsa().Token(With("1800000100", "1700000000")), keys);
  ASSERT_TRUE(late.ok()) << late.status();
  EXPECT_LT(late->expires, kNow);
}

// ---- Attacks -----------------------------------------------------------------------------------

TEST(CheckJwt, WhatNoKeyVouchesForIsRefused) {
  const fixture::JwtSigner ec("P-256", "ec");
  const fixture::JwtSigner stranger("RSA-2048", "rsa");
  const JwtKeys keys = KeysOf(absl::StrCat("{\"keys\":[", Rsa().Jwk(), ",", ec.Jwk(), "]}"));
  const std::string good = Rsa().Token(kClaims);
  ASSERT_TRUE(Check(good, keys).ok());
  const std::vector<std::string> parts = absl::StrSplit(good, '.');
  const auto with_header = [&](const std::string& header) { return Rsa().Sign(header, kClaims); };

  // The public key as the secret of an HMAC.
  const std::string confused_text = absl::StrCat(
      fixture::Base64UrlOf(R"({"alg":"HS256","kid":"rsa"})"), ".", fixture::Base64UrlOf(kClaims));
  std::string mac(32, '\0');
  unsigned size = 32;
  const std::string secret = Rsa().public_pem();
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
       reinterpret_cast<const unsigned char*>(confused_text.data()), confused_text.size(),
       reinterpret_cast<unsigned char*>(mac.data()), &size);

  const std::vector<std::string> bad = {
      stranger.Token(kClaims),
      absl::StrCat(confused_text, ".", fixture::Base64UrlOf(mac)),
      absl::StrCat(fixture::Base64UrlOf(R"({"alg":"none","kid":"rsa"})"), ".", parts[1], "."),
      absl::StrCat(fixture::Base64UrlOf(R"({"alg":"none","kid":"rsa"})"), ".", parts[1], ".",
                   parts[2]),
      with_header(R"({"alg":"RS256","kid":"ec"})"),
      with_header(R"({"alg":"ES256","kid":"rsa"})"),
      with_header(R"({"alg":"rs256","kid":"rsa"})"),
      with_header(R"({"alg":["RS256"],"kid":"rsa"})"),
      with_header(R"({"kid":"rsa"})"),
      with_header(R"({"alg":"RS256","kid":"other"})"),
      with_header(R"({"alg":"RS256","kid":["rsa"]})"),
      with_header(R"({"alg":"RS256"})"),  // of two keys
      with_header(R"({"alg":"RS256","kid":"rsa","crit":["exp"],"exp":1})"),
      with_header(R"({"alg":"RS256","kid":"rsa","crit":[]})"),
      with_header(R"({"alg":"RS256","kid":"rsa","cty":"JWT"})"),
      with_header(R"({"alg":"RS256","kid":"rsa","typ":"logout+jwt"})"),
      with_header(R"({"alg":"RS256","kid":"rsa","kid":"rsa"})"),
      with_header(R"(["alg","RS256"])"),
      with_header(R"({"alg":"RS256","kid":"rsa"} )" + std::string(1, '\0')),
      // The token brings its own key.
      stranger.Sign(absl::StrCat(R"({"alg":"RS256","kid":"rsa","jwk":)", stranger.Jwk(), "}"),
                    kClaims),
      stranger.Sign(R"({"alg":"RS256","kid":"rsa","jku":"https://evil.example/keys"})", kClaims),
      // Two members, of which one reader takes the first and another the last.
      Rsa().Token(With(R"("tenant":"museum")", R"("tenant":"bank","tenant":"museum")")),
      Rsa().Token("7"),
      Rsa().Token(""),
      Rsa().Token("{"),
      Rsa().Token(std::string(5000, '[')),
      Rsa().Token(absl::StrCat(R"({"a":)", std::string(9, '['), std::string(9, ']'), "}")),
      Rsa().Token("{\"sub\":\"\xff\xfe\"}"),
      Rsa().Token(With("anna", std::string(8 << 10, 'a'))),
      good + "=",
      good + ".",
      good + "." + parts[0],
      parts[0] + "." + parts[1],
      parts[0] + ".." + parts[2],
      "." + parts[1] + "." + parts[2],
      absl::StrCat(parts[0], ".", parts[1], ".", parts[2].substr(0, 10), " ", parts[2].substr(10)),
      "..",
      "",
  };
  for (const std::string& token : bad) {
    const absl::Status status = Check(token, keys).status();
    EXPECT_TRUE(absl::IsUnauthenticated(status)) << token.substr(0, 200) << "\n" << status;
  }
}

// Whatever character is exchanged for another, the token is good no more: none of its text can be
// written in two ways.
TEST(CheckJwt, EveryCharacterCounts) {
  for (const char* kind : {"P-256", "Ed25519"}) {
    const fixture::JwtSigner signer(kind, "k");
    const JwtKeys keys = KeysOf(signer.KeySet());
    const std::string token = signer.Token(kClaims);
    ASSERT_TRUE(Check(token, keys).ok());
    std::mt19937 random(7);
    for (size_t at = 0; at < token.size(); ++at) {
      std::string other = token;
      other[at] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"[random() % 64];
      if (other == token) other[at] = '+';
      EXPECT_FALSE(Check(other, keys).ok()) << kind << " at " << at;
    }
  }
}

TEST(CheckJwt, NothingOfATokenIsInARefusal) {
  const JwtKeys keys = KeysOf(Rsa().KeySet());
  const fixture::JwtSigner stranger("P-256", "secret-kid");
  for (const std::string& token :
       {stranger.Token(kClaims), Rsa().Token(With("vantage", "secret-audience")),
        Rsa().Token(With("museum", "secret/tenant"))}) {
    const absl::Status status = Check(token, keys).status();
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr(token.substr(token.size() - 20))));
  }
}

TEST(HasFormOfJwt, IsThreePartsAndNoTokenOfTheCallersFile) {
  EXPECT_TRUE(HasFormOfJwt(Rsa().Token(kClaims)));
  EXPECT_FALSE(HasFormOfJwt(MakeToken().token));
  for (const char* other : {"", "a.b", "a.b.c.d", "a.b.c=", "a.b c.d", "a.b.c\n"}) {
    EXPECT_FALSE(HasFormOfJwt(other)) << other;
  }
}

}  // namespace
}  // namespace vantage::auth
