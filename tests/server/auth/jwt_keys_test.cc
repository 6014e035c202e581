#include "server/auth/jwt_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "server/auth/jwt_issuer.h"
#include "tests/server/fixture/certificates.h"
#include "tests/server/fixture/jwt_signer.h"

namespace vantage::auth {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string SetOf(const std::vector<std::string>& keys) {
  std::string text = "{\"keys\":[";
  for (const std::string& key : keys) absl::StrAppend(&text, text.back() == '[' ? "" : ",", key);
  return text + "]}";
}

std::string WhyNot(const std::string& set) {
  const absl::StatusOr<JwtKeys> keys = JwtKeys::Parse(set);
  EXPECT_TRUE(absl::IsInvalidArgument(keys.status())) << keys.status() << " of " << set;
  return std::string(keys.status().message());
}

TEST(JwtKeys, KeysForOtherThingsAreLeftOut) {
  const fixture::JwtSigner rsa("RSA-2048", "rsa");
  const fixture::JwtSigner ec("P-384", "ec");
  const auto keys = JwtKeys::Parse(SetOf(
      {rsa.Jwk(",\"use\":\"sig\",\"alg\":\"PS384\",\"x5t\":\"abc\""), ec.Jwk(),
       fixture::JwtSigner("RSA-2048", "rsa").Jwk(",\"use\":\"enc\",\"alg\":\"RSA-OAEP\""),
       fixture::JwtSigner("RSA-2048", "e1").Jwk(",\"key_ops\":[\"encrypt\"]"),
       fixture::JwtSigner("RSA-2048", "e2").Jwk(",\"alg\":\"RSA-OAEP\""),
       R"({"kty":"OKP","crv":"X25519","x":"11qYAYKxCrfVS_7TyWQHOg7hcvPapiMlrwIaaPcHURo","kid":"x"})",
       R"({"kty":"of-tomorrow","kid":"t"})"}));
  ASSERT_TRUE(keys.ok()) << keys.status();
  EXPECT_EQ(keys->size(), 2U);
  EXPECT_EQ(keys->Find("rsa")->algorithm, "PS384");
  EXPECT_EQ(keys->Find("ec")->algorithm, "ES384");
  EXPECT_EQ(keys->Find("e1"), nullptr);
  EXPECT_EQ(keys->Find(""), nullptr);
  EXPECT_EQ(keys->Find(std::nullopt), nullptr);  // which of the two?
  EXPECT_NE(keys->Find("rsa")->thumbprint, keys->Find("ec")->thumbprint);
}

TEST(JwtKeys, WhatIsWrongIsNamedByItsPlaceAndNeverShown) {
  const std::string good = fixture::JwtSigner("P-256", "good").Jwk();
  const fixture::JwtSigner rsa("RSA-2048", "rsa");
  const fixture::JwtSigner ec("P-256", "ec");
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {R"({"kty":"oct","k":"c2VjcmV0LXZhbHVl","kid":"s"})", "symmetric"},
      {fixture::JwtSigner("RSA-1024", "weak").Jwk(), "1024 bits is too weak"},
      {ec.Jwk(R"(,"d":"c2VjcmV0LXZhbHVl")"), "private key"},
      {good, "same 'kid'"},
      {fixture::JwtSigner("P-256", "").Jwk(R"(,"kid":7)"), "'kid'"},
      {R"({"kty":"RSA","kid":"r","e":"AQAB"})", "'n'"},
      {absl::StrReplaceAll(rsa.Jwk(), {{"AQAB", "Ag"}}), "no RSA key"},
      {absl::StrReplaceAll(rsa.Jwk(), {{"AQAB", "AQAAAAE"}}), "32 bits"},
      {absl::StrReplaceAll(rsa.Jwk(), {{"AQAB", "AQ=="}}), "'e'"},
      {absl::StrReplaceAll(ec.Jwk(), {{"P-256", "P-384"}}), "no point"},
      {R"({"kty":"EC","crv":"P-256","kid":"o","x":"f83OJ3D2xF1Bg8vub9tLe1gHMzV76e8Tus9uPHvRVEU",)"
       R"("y":"f83OJ3D2xF1Bg8vub9tLe1gHMzV76e8Tus9uPHvRVEU"})",
       "no key"},  // not on the curve
      {R"({"kty":"OKP","crv":"Ed25519","x":"c2VjcmV0LXZhbHVl","kid":"e"})", "Ed25519"},
      {R"("key")", "no JSON object"},
      {R"({"kid":"k"})", "'kty'"},
  };
  for (const auto& [key, why] : wrong) {
    const std::string message = WhyNot(SetOf({good, key}));
    EXPECT_THAT(message, HasSubstr("key 2: ")) << key;
    EXPECT_THAT(message, HasSubstr(why)) << key;
    EXPECT_THAT(message, Not(HasSubstr("c2VjcmV0"))) << key;
  }
  EXPECT_THAT(WhyNot(SetOf({})), HasSubstr("none of its keys"));
  EXPECT_THAT(WhyNot(SetOf({ec.Jwk(), fixture::JwtSigner("P-256", "").Jwk()})),
              HasSubstr("each needs a 'kid'"));
  EXPECT_THAT(WhyNot(SetOf(std::vector<std::string>(65, good))), HasSubstr("more than 64"));
  for (const std::string& text :
       std::vector<std::string>{"", "[]", "{}", R"({"keys":{}})", good, SetOf({good}) + "x",
                                R"({"keys":[],"keys":[]})", std::string(100'000, '{')}) {
    EXPECT_THAT(WhyNot(text), HasSubstr("JSON Web Key Set")) << text.substr(0, 100);
  }
}

// ---- The file ----------------------------------------------------------------------------------

const absl::Time kIssued = absl::FromUnixSeconds(1'800'000'000);
constexpr RateLimits::Time kBegin{std::chrono::seconds(1000)};
constexpr char kAnna[] =
    R"({"iss":"i","aud":"a","sub":"anna","tenant":"museum","roles":"read","exp":1800000100})";

class JwtIssuerTest : public ::testing::Test {
 protected:
  ~JwtIssuerTest() override { std::remove(Path().c_str()); }
  static std::string Path() {
    return absl::StrCat(::testing::TempDir(), "/jwt-keys-",
                        ::testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  static void Write(const std::string& text) {
    fixture::WriteTestFile(Path(), text);
    chmod(Path().c_str(), 0600);
  }
  static JwtOptions Options() {
    JwtOptions options;
    options.keys_file = Path();
    options.issuer = "i";
    options.audience = "a";
    return options;
  }
  static std::string Name(JwtIssuer& issuer, const std::string& token,
                          const std::string& address = "home") {
    const absl::StatusOr<Caller> caller = issuer.Check(token, address, kIssued, kBegin);
    return caller.ok() ? caller->name : absl::StatusCodeToString(caller.status().code());
  }
};

TEST_F(JwtIssuerTest, KeysComeAndGoWithTheFileAndStayWhenItCannotBeUsed) {
  const fixture::JwtSigner first("P-256", "first");
  const fixture::JwtSigner second("Ed25519", "second");
  EXPECT_TRUE(absl::IsNotFound(JwtIssuer::Open(Options()).status()));
  Write(first.KeySet());
  const auto issuer = JwtIssuer::Open(Options());
  ASSERT_TRUE(issuer.ok()) << issuer.status();
  EXPECT_FALSE((*issuer)->Refresh().value());
  const std::string by_first = first.Token(kAnna);
  EXPECT_EQ(Name(**issuer, by_first), "jwt:anna");
  EXPECT_EQ(Name(**issuer, second.Token(kAnna)), "UNAUTHENTICATED");
  const std::string key = (*issuer)->Check(by_first, "home", kIssued, kBegin)->credential;
  EXPECT_TRUE((*issuer)->HasKey(key));

  Write(SetOf({first.Jwk(), second.Jwk()}));
  EXPECT_TRUE((*issuer)->Refresh().value());
  EXPECT_EQ(Name(**issuer, second.Token(kAnna)), "jwt:anna");
  Write("nonsense");
  const absl::Status wrong = (*issuer)->Refresh().status();
  EXPECT_THAT(std::string(wrong.message()), HasSubstr(Path()));
  EXPECT_EQ(Name(**issuer, by_first), "jwt:anna");
  Write(second.KeySet());
  chmod(Path().c_str(), 0622);
  EXPECT_TRUE(absl::IsPermissionDenied((*issuer)->Refresh().status()));
  EXPECT_EQ(Name(**issuer, by_first), "jwt:anna");

  // A key that left takes with it what was checked by it.
  chmod(Path().c_str(), 0600);
  EXPECT_TRUE((*issuer)->Refresh().value());
  EXPECT_EQ(Name(**issuer, by_first), "UNAUTHENTICATED");
  EXPECT_FALSE((*issuer)->HasKey(key));
  // The same id for another key does not bring it back.
  Write(fixture::JwtSigner("P-256", "first").KeySet());
  EXPECT_TRUE((*issuer)->Refresh().value());
  EXPECT_FALSE((*issuer)->HasKey(key));
}

TEST_F(JwtIssuerTest, ForgersOfAnAddressHaveNoMoreChecked) {
  const fixture::JwtSigner own("P-256", "k");
  const fixture::JwtSigner forger("P-256", "k");
  Write(own.KeySet());
  const auto issuer = JwtIssuer::Open(Options()).value();
  const std::string shown = own.Token(kAnna);
  EXPECT_EQ(Name(*issuer, shown), "jwt:anna");
  int checked = 0;
  for (int i = 0; i < 1000; ++i) {
    checked += Name(*issuer, forger.Token(kAnna)) == "UNAUTHENTICATED" ? 1 : 0;
  }
  EXPECT_EQ(checked, 200);
  EXPECT_EQ(Name(*issuer, own.Token(kAnna)), "RESOURCE_EXHAUSTED");
  EXPECT_EQ(Name(*issuer, shown), "jwt:anna");  // was checked before
  EXPECT_EQ(Name(*issuer, own.Token(kAnna), "elsewhere"), "jwt:anna");
  // Soon after the forger pauses, others are let in again.
  EXPECT_TRUE(
      issuer->Check(own.Token(kAnna), "home", kIssued, kBegin + std::chrono::milliseconds(20))
          .ok());
}

}  // namespace
}  // namespace vantage::auth
