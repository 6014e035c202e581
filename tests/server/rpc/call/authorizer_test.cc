// Whom the authorizer lets in, call by call; that every RPC asks it is another test's subject.
#include "server/rpc/call/authorizer.h"

#include <gmock/gmock.h>
#include <grpc/grpc_security_constants.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/auth/forwarded.h"
#include "server/contract/error.h"
#include "tests/server/fixture/bare_server.h"
#include "tests/server/fixture/certificates.h"
#include "tests/server/fixture/jwt_signer.h"

namespace vantage::rpc {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr RpcRule kReading = RuleOf("GetSession");
constexpr RpcRule kPlanning = RuleOf("CreatePlan");

class Admissions : public ::testing::Test {
 protected:
  ~Admissions() override {
    std::remove(Path().c_str());
    std::remove(KeysPath().c_str());
  }

  // A token for a line of the callers file.
  std::string AddCaller(const std::string& name_tenant_roles, const std::string& expires = "") {
    const auth::NewToken made = auth::MakeToken();
    absl::StrAppend(&callers_, name_tenant_roles, " ", made.credential, " ", expires, "\n");
    return made.token;
  }
  void WriteCallers() const {
    fixture::WriteTestFile(Path(), callers_);
    chmod(Path().c_str(), 0600);
  }
  void TellCallersApart() {
    WriteCallers();
    file_ = auth::CallersFile::Open(Path()).value();
  }

  Admission Admit(const RpcRule& rule, const std::multimap<std::string, std::string>& metadata) {
    return AdmitBy(server_, rule, metadata);
  }
  Admission AdmitBy(fixture::BareServer& server, const RpcRule& rule,
                    const std::multimap<std::string, std::string>& metadata) {
    if (authorizer_ == nullptr) {
      authorizer_ = std::make_unique<Authorizer>(options_, std::move(file_), std::move(issuer_));
    }
    Admission admission;
    server.Call(
        [&](grpc::ServerContextBase& context) {
          admission = authorizer_->Admit(rule, context);
          return grpc::Status::OK;
        },
        metadata);
    return admission;
  }
  Admission AdmitBearer(const RpcRule& rule, const std::string& token) {
    return Admit(rule, {{"authorization", "Bearer " + token}});
  }
  std::string Refusal(const std::multimap<std::string, std::string>& metadata) {
    const Admission admission = Admit(kReading, metadata);
    EXPECT_TRUE(absl::IsUnauthenticated(admission.status)) << admission.status;
    EXPECT_EQ(admission.caller, "ipv4:127.0.0.1");
    EXPECT_FALSE(admission.tenant.has_value());
    return contract::ReasonOf(admission.status);
  }

  void WriteJwtKeys(const std::string& set) const {
    fixture::WriteTestFile(KeysPath(), set);
    chmod(KeysPath().c_str(), 0600);
  }
  void TakeJwts(const std::string& set) {
    WriteJwtKeys(set);
    options_.jwt.keys_file = KeysPath();
    options_.jwt.issuer = "https://login.example";
    options_.jwt.audience = "vantage";
    issuer_ = auth::JwtIssuer::Open(options_.jwt).value();
  }
  // Claims of one who is good for so long, and may read.
  static std::string Claims(const std::string& subject, absl::Duration left = absl::Hours(1)) {
    return absl::StrCat(R"({"iss":"https://login.example","aud":["vantage"],"sub":")", subject,
                        R"(","tenant":"museum","roles":["read"],"exp":)",
                        absl::ToUnixSeconds(absl::Now() + left), "}");
  }

  auth::AccessOptions options_;
  std::string callers_;
  std::unique_ptr<Authorizer> authorizer_;

 private:
  static std::string Path() {
    return absl::StrCat(::testing::TempDir(), "/admissions-",
                        ::testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  static std::string KeysPath() { return Path() + "-keys"; }

  fixture::BareServer server_;
  std::unique_ptr<auth::CallersFile> file_;
  std::unique_ptr<auth::JwtIssuer> issuer_;
};

TEST_F(Admissions, WithoutCallersEverybodyMayDoEverything) {
  const Admission admission = Admit(RuleOf("DeleteSession"), {});
  EXPECT_TRUE(admission.status.ok()) << admission.status;
  EXPECT_EQ(admission.caller, "ipv4:127.0.0.1");
  EXPECT_FALSE(admission.tenant.has_value());  // sees all sessions
}

TEST_F(Admissions, WithoutCallersAProxyNamesTheTenant) {
  options_.tenant_metadata = "x-tenant";
  const Admission museum = Admit(kPlanning, {{"x-tenant", "museum"}});
  EXPECT_TRUE(museum.status.ok()) << museum.status;
  EXPECT_EQ(museum.tenant, "museum");
  EXPECT_EQ(museum.caller, "museum");
  // Nobody's sessions are no tenant's, not everybody's.
  EXPECT_EQ(Admit(kPlanning, {}).tenant, "");
}

TEST_F(Admissions, ATenantThatIsNotClearIsRefused) {
  options_.tenant_metadata = "x-tenant";
  EXPECT_EQ(Refusal({{"x-tenant", "museum"}, {"x-tenant", "bank"}}), "TENANT_AMBIGUOUS");
  EXPECT_EQ(Refusal({{"x-tenant", std::string(201, 'm')}}), "TENANT_MISSING");
  EXPECT_TRUE(Admit(kReading, {{"x-tenant", std::string(200, 'm')}}).status.ok());
}

TEST_F(Admissions, ATokenTellsWhoCallsAndForWhom) {
  const std::string tablet = AddCaller("tablet museum read,plan");
  const std::string office = AddCaller("office bank administer");
  TellCallersApart();
  const Admission first = AdmitBearer(kPlanning, tablet);
  EXPECT_TRUE(first.status.ok()) << first.status;
  EXPECT_EQ(first.caller, "tablet");
  EXPECT_EQ(first.tenant, "museum");
  // The scheme's case and spaces around the token do not matter.
  const Admission second = Admit(kPlanning, {{"authorization", "bEARER  " + office}});
  EXPECT_TRUE(second.status.ok()) << second.status;
  EXPECT_EQ(second.caller, "office");
  EXPECT_EQ(second.tenant, "bank");
}

TEST_F(Admissions, WhoShowsNothingGoodIsToldWhatIsWrong) {
  const std::string tablet = AddCaller("tablet museum read");
  const std::string former = AddCaller("former museum read", "2020-01-31T00:00:00Z");
  TellCallersApart();
  EXPECT_EQ(Refusal({}), "CREDENTIALS_MISSING");
  EXPECT_EQ(Refusal({{"authorization", "Bearer nonsense"}}), "TOKEN_UNKNOWN");
  EXPECT_EQ(Refusal({{"authorization", "Basic " + tablet}}), "TOKEN_UNKNOWN");
  EXPECT_EQ(Refusal({{"authorization", tablet}}), "TOKEN_UNKNOWN");
  EXPECT_EQ(Refusal({{"authorization", "Bearer " + former}}), "TOKEN_EXPIRED");
  // Nobody knows which of two was meant.
  EXPECT_EQ(Refusal({{"authorization", "Bearer " + tablet}, {"authorization", "Bearer " + tablet}}),
            "TOKEN_UNKNOWN");
}

TEST_F(Admissions, ARefusalNeverShowsTheToken) {
  AddCaller("tablet museum read");
  TellCallersApart();
  const Admission admission = AdmitBearer(kReading, "a-secret-of-somebody");
  EXPECT_THAT(std::string(admission.status.message()), Not(HasSubstr("secret")));
  EXPECT_THAT(admission.caller, Not(HasSubstr("secret")));
}

TEST_F(Admissions, ARoleThatIsMissingIsNamed) {
  const std::string tablet = AddCaller("tablet museum read");
  TellCallersApart();
  EXPECT_TRUE(AdmitBearer(kReading, tablet).status.ok());
  const Admission refused = AdmitBearer(kPlanning, tablet);
  EXPECT_TRUE(absl::IsPermissionDenied(refused.status)) << refused.status;
  EXPECT_EQ(contract::ReasonOf(refused.status), "ROLE_MISSING");
  EXPECT_THAT(std::string(refused.status.message()), HasSubstr("needs the role plan"));
  EXPECT_EQ(refused.caller, "tablet");
}

TEST_F(Admissions, AProxyMustSayForWhomItCalls) {
  options_.tenant_metadata = "x-tenant";
  const std::string proxy = AddCaller("proxy * read");
  const std::string tablet = AddCaller("tablet museum read");
  TellCallersApart();
  EXPECT_EQ(contract::ReasonOf(AdmitBearer(kReading, proxy).status), "TENANT_MISSING");
  const Admission named =
      Admit(kReading, {{"authorization", "Bearer " + proxy}, {"x-tenant", "bank"}});
  EXPECT_TRUE(named.status.ok()) << named.status;
  EXPECT_EQ(named.tenant, "bank");
  EXPECT_EQ(named.caller, "proxy/bank");
  // Others cannot choose.
  EXPECT_EQ(Admit(kReading, {{"authorization", "Bearer " + tablet}, {"x-tenant", "bank"}}).tenant,
            "museum");
}

TEST_F(Admissions, WhoeverCallsTooOftenWaitsAndNobodyElse) {
  options_.calls_per_second = 0.001;
  options_.calls_at_once = 2;
  const std::string tablet = AddCaller("tablet museum read");
  const std::string office = AddCaller("office museum read");
  TellCallersApart();
  EXPECT_TRUE(AdmitBearer(kReading, tablet).status.ok());
  EXPECT_TRUE(AdmitBearer(kReading, tablet).status.ok());
  const Admission third = AdmitBearer(kReading, tablet);
  EXPECT_TRUE(absl::IsResourceExhausted(third.status)) << third.status;
  EXPECT_EQ(contract::ReasonOf(third.status), "RATE_LIMITED");
  EXPECT_TRUE(AdmitBearer(kReading, office).status.ok());
}

// Who tries tokens is slowed down; who has one at the same address is not.
TEST_F(Admissions, FailuresOfAnAddressAreLimited) {
  const std::string tablet = AddCaller("tablet museum read");
  TellCallersApart();
  int waits = 0;
  for (int i = 0; i < 60; ++i) {
    const Admission admission = AdmitBearer(kReading, absl::StrCat("guess-", i));
    EXPECT_FALSE(admission.status.ok());
    waits += contract::ReasonOf(admission.status) == "RATE_LIMITED" ? 1 : 0;
  }
  EXPECT_GE(waits, 30);  // twenty at once, and one a second after
  EXPECT_LE(waits, 40);
  EXPECT_TRUE(AdmitBearer(kReading, tablet).status.ok());
}

TEST_F(Admissions, AStreamIsLetInForAsLongAsItsCallerWouldBe) {
  const std::string tablet = AddCaller("tablet museum read,plan");
  TellCallersApart();
  const Admission admission = AdmitBearer(kPlanning, tablet);
  ASSERT_TRUE(admission.status.ok()) << admission.status;
  EXPECT_TRUE(authorizer_->StillLetsIn(kPlanning, admission).ok());

  const std::string with_plan = callers_;
  const auto say = [&](const std::string& callers) {
    callers_ = callers;
    WriteCallers();
    EXPECT_TRUE(authorizer_->RefreshCallers().value());
    return contract::ReasonOf(authorizer_->StillLetsIn(kPlanning, admission));
  };
  std::string reading = with_plan;
  reading.replace(reading.find("read,plan"), 9, "read");
  EXPECT_EQ(say(reading), "ROLE_MISSING");
  std::string elsewhere = with_plan;
  elsewhere.replace(elsewhere.find("museum"), 6, "bank");
  EXPECT_EQ(say(elsewhere), "CREDENTIALS_WITHDRAWN");
  EXPECT_EQ(say(with_plan + "another bank read certificate:another\n"), "");
  EXPECT_EQ(say("another bank read certificate:another\n"), "CREDENTIALS_WITHDRAWN");
}

// Calls that a proxy passes on by a socket, beside those that come directly.
class PassedOn : public Admissions {
 protected:
  PassedOn() {
    options_.certificate_metadata = "x-client-certificate";
    options_.address_metadata = "x-forwarded-for";
    callers_ = "office museum read certificate:office.example\nlone museum read certificate:lone\n";
    TellCallersApart();
  }

  Admission ByProxy(const std::multimap<std::string, std::string>& metadata) {
    return AdmitBy(proxied_, kReading, metadata);
  }
  std::string Certificate(const std::string& name, const std::string& alternative = "") const {
    return fixture::DerInBase64(authority_.Issue(name, alternative).certificate);
  }

 private:
  const fixture::TestAuthority authority_{"clients"};
  fixture::BareServer proxied_{
      absl::StrCat("unix:", ::testing::TempDir(), "/passed-on-", getpid())};
};

TEST_F(PassedOn, ACertificateTellsWhoCalls) {
  const Admission office =
      ByProxy({{"x-client-certificate", Certificate("whoever", "DNS:x,DNS:office.example")}});
  EXPECT_TRUE(office.status.ok()) << office.status;
  EXPECT_EQ(office.caller, "office");
  EXPECT_EQ(office.tenant, "museum");
  EXPECT_EQ(ByProxy({{"x-client-certificate", Certificate("lone")}}).caller, "lone");
  EXPECT_EQ(contract::ReasonOf(
                ByProxy({{"x-client-certificate", Certificate("other", "DNS:other")}}).status),
            "CERTIFICATE_UNKNOWN");
  EXPECT_EQ(contract::ReasonOf(ByProxy({}).status), "CREDENTIALS_MISSING");
}

TEST_F(PassedOn, WhatIsNoCertificateIsRefusedAndNotQuoted) {
  const std::string good = Certificate("lone");
  for (const std::string& bad : {std::string("secret"), std::string("c2VjcmV0"), good.substr(4),
                                 good.substr(0, good.size() - 8), good + "AAAA", std::string()}) {
    const Admission admission = ByProxy({{"x-client-certificate", bad}});
    EXPECT_TRUE(absl::IsUnauthenticated(admission.status)) << bad;
    EXPECT_EQ(contract::ReasonOf(admission.status), "CERTIFICATE_INVALID") << bad;
    EXPECT_THAT(std::string(admission.status.message()), HasSubstr("x-client-certificate"));
    EXPECT_THAT(std::string(admission.status.message()), Not(HasSubstr("ecret")));
  }
  EXPECT_EQ(contract::ReasonOf(
                ByProxy({{"x-client-certificate", good}, {"x-client-certificate", good}}).status),
            "CERTIFICATE_INVALID");
}

TEST_F(PassedOn, OnlyTheProxyIsBelieved) {
  const Admission forged = Admit(
      kReading, {{"x-client-certificate", Certificate("lone")}, {"x-forwarded-for", "192.0.2.7"}});
  EXPECT_EQ(contract::ReasonOf(forged.status), "CREDENTIALS_MISSING");
  EXPECT_EQ(forged.caller, "ipv4:127.0.0.1");
  EXPECT_THAT(forged.peer, testing::StartsWith("ipv4:127.0.0.1:"));
}

TEST_F(PassedOn, NothingIsBelievedUnlessAskedFor) {
  options_.certificate_metadata.clear();
  options_.address_metadata.clear();
  const Admission admission =
      ByProxy({{"x-client-certificate", Certificate("lone")}, {"x-forwarded-for", "192.0.2.7"}});
  EXPECT_EQ(contract::ReasonOf(admission.status), "CREDENTIALS_MISSING");
  EXPECT_THAT(admission.caller, testing::StartsWith("unix:"));
}

TEST_F(PassedOn, AnAddressThatFailsLocksNobodyElseOut) {
  std::string reason;
  for (int i = 0; i < 30; ++i) {
    const Admission guess =
        ByProxy({{"x-forwarded-for", "192.0.2.7"}, {"authorization", "Bearer guess"}});
    EXPECT_EQ(guess.caller, "ipv4:192.0.2.7");
    EXPECT_EQ(guess.peer, "ipv4:192.0.2.7");
    reason = contract::ReasonOf(guess.status);
  }
  EXPECT_EQ(reason, "RATE_LIMITED");
  EXPECT_EQ(contract::ReasonOf(ByProxy({{"x-forwarded-for", "2001:db8::7"}}).status),
            "CREDENTIALS_MISSING");
  EXPECT_EQ(contract::ReasonOf(ByProxy({{"x-forwarded-for", "no address"}}).status),
            "CREDENTIALS_MISSING");
}

// By the proxy a certificate has the names that it has on a connection of its own.
TEST_F(PassedOn, TheNamesOfACertificateAreThoseOfADirectConnection) {
  const fixture::TestAuthority authority("both");
  const fixture::CertifiedKey own = authority.Issue("server", "IP:127.0.0.1");
  for (const char* alternative :
       {"", "DNS:office.example", "email:office@museum.example,DNS:b.example,DNS:a.example",
        "URI:spiffe://museum/office,IP:192.0.2.7,IP:2001:db8::7"}) {
    const fixture::CertifiedKey client = authority.Issue("Caf\xc3\xa9 office", alternative);
    grpc::SslServerCredentialsOptions asks(
        GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    asks.pem_root_certs = authority.certificate();
    asks.pem_key_cert_pairs = {{own.key, own.certificate}};
    grpc::SslCredentialsOptions shows;
    shows.pem_root_certs = authority.certificate();
    shows.pem_private_key = client.key;
    shows.pem_cert_chain = client.certificate;
    fixture::BareServer direct("127.0.0.1:0", grpc::SslServerCredentials(asks),
                               grpc::SslCredentials(shows));
    std::vector<std::string> names;
    direct.Call([&](grpc::ServerContextBase& context) {
      for (const char* property : {GRPC_X509_SAN_PROPERTY_NAME, GRPC_X509_CN_PROPERTY_NAME}) {
        for (const grpc::string_ref& name : context.auth_context()->FindPropertyValues(property)) {
          names.emplace_back(name.data(), name.size());
        }
      }
      return grpc::Status::OK;
    });
    EXPECT_THAT(names, Not(testing::IsEmpty())) << alternative;
    EXPECT_EQ(auth::CertificateNames(fixture::DerInBase64(client.certificate)).value(), names)
        << alternative;
  }
}

// ---- JWTs --------------------------------------------------------------------------------------

TEST_F(Admissions, AJwtNamesItsCallerBesideTheCallersFile) {
  const fixture::JwtSigner signer("P-256", "k");
  const std::string tablet = AddCaller("tablet bank read");
  TellCallersApart();
  TakeJwts(signer.KeySet());
  const Admission anna = AdmitBearer(kReading, signer.Token(Claims("anna")));
  EXPECT_TRUE(anna.status.ok()) << anna.status;
  EXPECT_EQ(anna.caller, "jwt:anna");
  EXPECT_EQ(anna.tenant, "museum");
  EXPECT_FALSE(anna.credential.empty());  // callers are told apart
  EXPECT_EQ(AdmitBearer(kReading, tablet).tenant, "bank");
  // Renewed, she is the same.
  EXPECT_EQ(AdmitBearer(kReading, signer.Token(Claims("anna", absl::Hours(2)))).caller, "jwt:anna");
  const Admission planning = AdmitBearer(kPlanning, signer.Token(Claims("anna")));
  EXPECT_EQ(contract::ReasonOf(planning.status), "ROLE_MISSING");
}

TEST_F(Admissions, WithJwtKeysAloneCallersAreToldApartToo) {
  const fixture::JwtSigner signer("Ed25519", "k");
  TakeJwts(signer.KeySet());
  EXPECT_EQ(Refusal({}), "CREDENTIALS_MISSING");
  EXPECT_EQ(Refusal({{"authorization", "Bearer nonsense"}}), "TOKEN_UNKNOWN");
  EXPECT_EQ(Refusal({{"authorization", "Bearer " + auth::MakeToken().token}}), "TOKEN_UNKNOWN");
  EXPECT_TRUE(AdmitBearer(kReading, signer.Token(Claims("anna"))).status.ok());
}

TEST_F(Admissions, AJwtThatIsNotGoodIsToldWhatIsWrong) {
  const fixture::JwtSigner signer("P-256", "k");
  const fixture::JwtSigner forger("P-256", "k");
  TakeJwts(signer.KeySet());
  const auto reason = [&](const std::string& token) {
    return Refusal({{"authorization", "Bearer " + token}});
  };
  EXPECT_EQ(reason(forger.Token(Claims("anna"))), "TOKEN_UNKNOWN");
  EXPECT_EQ(reason("a.b.c"), "TOKEN_UNKNOWN");
  EXPECT_EQ(reason(signer.Token(Claims("anna", -absl::Seconds(1)))), "TOKEN_EXPIRED");
  EXPECT_EQ(reason(signer.Token("{}")), "TOKEN_UNFIT");
}

TEST_F(Admissions, ForgersOfAnAddressWaitAndWhoIsKnownDoesNot) {
  const fixture::JwtSigner signer("P-256", "k");
  const fixture::JwtSigner forger("P-256", "k");
  TakeJwts(signer.KeySet());
  const std::string anna = signer.Token(Claims("anna"));
  EXPECT_TRUE(AdmitBearer(kReading, anna).status.ok());
  int waits = 0;
  for (int i = 0; i < 40; ++i) {
    const Admission admission = AdmitBearer(kReading, forger.Token(Claims("anna")));
    EXPECT_FALSE(admission.status.ok());
    waits += contract::ReasonOf(admission.status) == "RATE_LIMITED" ? 1 : 0;
  }
  EXPECT_GE(waits, 10);
  EXPECT_TRUE(AdmitBearer(kReading, anna).status.ok());
}

TEST_F(Admissions, AStreamEndsWithItsJwtOrItsKey) {
  const fixture::JwtSigner signer("P-256", "k");
  const fixture::JwtSigner next("P-256", "next");
  TakeJwts(signer.KeySet());
  const Admission long_one = AdmitBearer(kReading, signer.Token(Claims("anna")));
  const Admission short_one = AdmitBearer(kReading, signer.Token(Claims("anna", absl::Seconds(3))));
  ASSERT_TRUE(short_one.status.ok()) << short_one.status;
  const auto now = [&](const Admission& admission) {
    return contract::ReasonOf(authorizer_->StillLetsIn(kReading, admission));
  };
  EXPECT_EQ(now(long_one), "");
  absl::SleepFor(short_one.expires - absl::Now() + absl::Milliseconds(10));
  EXPECT_EQ(now(short_one), "TOKEN_EXPIRED");
  EXPECT_EQ(now(long_one), "");
  WriteJwtKeys("nonsense");
  EXPECT_FALSE(authorizer_->RefreshJwtKeys().ok());
  EXPECT_EQ(now(long_one), "");
  WriteJwtKeys(next.KeySet());
  EXPECT_TRUE(authorizer_->RefreshJwtKeys().value());
  EXPECT_EQ(now(long_one), "CREDENTIALS_WITHDRAWN");
}

}  // namespace
}  // namespace vantage::rpc
