#include "server/field/certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

#include "server/field/x509.h"
#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr absl::Duration kDay = absl::Hours(24);
const absl::Time kNow = absl::FromUnixSeconds(1'800'000'000);

class CertificateTest : public ::testing::Test {
 protected:
  CertificateTest() {
    std::string name = ::testing::TempDir() + "/certificate-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~CertificateTest() override { std::filesystem::remove_all(folder_); }

  ServedCertificate Keep(const ServedNames& names, absl::Time now = kNow) const {
    const auto kept = KeepCertificate(folder_, names, now);
    EXPECT_TRUE(kept.ok()) << kept.status();
    return kept.ok() ? *kept : ServedCertificate();
  }
  auth::OwnedCertificate Read(const std::string& path) const {
    return CertificateOfPem(store::ReadWhole(path).value_or(""));
  }
  std::string File(const std::string& name) const { return folder_ + "/" + name; }

  std::string folder_;
};

// What a tablet does that trusts the authority: OpenSSL's own verification, for a server that was
// asked for by address or by name. X509_V_OK, or what is wrong.
int Verified(X509* authority, X509* certificate, const std::string& address,
             const std::string& name, absl::Time now) {
  const std::unique_ptr<X509_STORE, auth::FreedBy<X509_STORE_free>> store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  const std::unique_ptr<X509_STORE_CTX, auth::FreedBy<X509_STORE_CTX_free>> context(
      X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), certificate, nullptr);
  X509_STORE_CTX_set_purpose(context.get(), X509_PURPOSE_SSL_SERVER);
  X509_VERIFY_PARAM* ask = X509_STORE_CTX_get0_param(context.get());
  X509_VERIFY_PARAM_set_flags(ask, X509_V_FLAG_X509_STRICT);
  X509_VERIFY_PARAM_set_time(ask, absl::ToTimeT(now));
  if (!address.empty()) X509_VERIFY_PARAM_set1_ip_asc(ask, address.c_str());
  if (!name.empty()) X509_VERIFY_PARAM_set1_host(ask, name.c_str(), 0);
  return X509_verify_cert(context.get()) == 1 ? X509_V_OK : X509_STORE_CTX_get_error(context.get());
}

TEST_F(CertificateTest, IsGoodForTheLaptopsAddressesAndNamesToWhoTrustsTheAuthority) {
  const ServedCertificate served = Keep({"site-laptop", {"192.168.1.5", "2001:db8::5"}});
  EXPECT_TRUE(served.new_authority);
  EXPECT_TRUE(served.new_certificate);
  const auto authority = Read(AuthorityIn(folder_));
  const auto own = Read(CertificateIn(folder_));
  for (const char* address : {"192.168.1.5", "2001:db8::5", "127.0.0.1", "::1"}) {
    EXPECT_EQ(Verified(authority.get(), own.get(), address, "", kNow), X509_V_OK) << address;
  }
  for (const char* name : {"site-laptop", "site-laptop.local", "localhost"}) {
    EXPECT_EQ(Verified(authority.get(), own.get(), "", name, kNow), X509_V_OK) << name;
  }
  EXPECT_EQ(Verified(authority.get(), own.get(), "192.168.1.6", "", kNow),
            X509_V_ERR_IP_ADDRESS_MISMATCH);
  EXPECT_EQ(Verified(authority.get(), own.get(), "", "other", kNow), X509_V_ERR_HOSTNAME_MISMATCH);
  // A tablet whose clock is behind by some hours.
  EXPECT_EQ(Verified(authority.get(), own.get(), "192.168.1.5", "", kNow - kDay / 2), X509_V_OK);
  // Apple's limit.
  EXPECT_LE(EndOf(*own) - BeginOf(*own), 825 * kDay);
  EXPECT_EQ(served.expires, EndOf(*own));
  EXPECT_EQ(served.authority_der, DerOf(*authority));
}

TEST_F(CertificateTest, StaysAsLongAsItFits) {
  const ServedNames names{"site-laptop", {"192.168.1.5"}};
  const ServedCertificate first = Keep(names);
  const ServedCertificate again = Keep(names, kNow + 149 * kDay);
  EXPECT_FALSE(again.new_authority);
  EXPECT_FALSE(again.new_certificate);
  EXPECT_EQ(again.fingerprint, first.fingerprint);
}

TEST_F(CertificateTest, IsMadeAnewByTheSameAuthorityWhenAddressesChangeOrItNearsItsEnd) {
  const ServedCertificate first = Keep({"site-laptop", {"192.168.1.5"}});
  const auto authority = Read(AuthorityIn(folder_));
  const ServedCertificate moved = Keep({"site-laptop", {"10.42.0.1"}});
  EXPECT_TRUE(moved.new_certificate);
  EXPECT_EQ(moved.authority_fingerprint, first.authority_fingerprint);
  EXPECT_EQ(Verified(authority.get(), Read(CertificateIn(folder_)).get(), "10.42.0.1", "", kNow),
            X509_V_OK);
  const absl::Time later = kNow + 151 * kDay;
  EXPECT_TRUE(Keep({"site-laptop", {"10.42.0.1"}}, later).new_certificate);
  EXPECT_EQ(Verified(authority.get(), Read(CertificateIn(folder_)).get(), "10.42.0.1", "",
                     later + 150 * kDay),
            X509_V_OK);
  // A clock that was ahead when it was made; the next look finds nothing to do.
  EXPECT_TRUE(Keep({"site-laptop", {"10.42.0.1"}}, kNow - 700 * kDay).new_certificate);
  EXPECT_FALSE(Keep({"site-laptop", {"10.42.0.1"}}, kNow - 700 * kDay).new_certificate);
}

TEST_F(CertificateTest, TheAuthorityIsMadeAnewInTimeAndNoCertificateOutlivesIt) {
  const ServedNames names{"site-laptop", {"192.168.1.5"}};
  const ServedCertificate first = Keep(names);
  const absl::Time late = kNow + 3600 * kDay;
  const ServedCertificate last = Keep(names, late);
  EXPECT_EQ(last.authority_fingerprint, first.authority_fingerprint);
  EXPECT_LE(last.expires, EndOf(*Read(AuthorityIn(folder_))));
  const ServedCertificate next = Keep(names, kNow + 3630 * kDay);
  EXPECT_TRUE(next.new_authority);
  EXPECT_TRUE(next.new_certificate);
}

// Whoever copied its key cannot pose as anybody's site on the internet.
TEST_F(CertificateTest, TheAuthorityIsGoodForNoOtherNames) {
  Keep({"site-laptop", {"192.168.1.5"}});
  const auto authority = Read(AuthorityIn(folder_));
  const auto authority_key = KeyOfPem(*store::ReadWhole(File("authority.key")));
  for (const auto& [name, expected] :
       {std::pair("bank.example", X509_V_ERR_PERMITTED_VIOLATION),
        std::pair("notsite-laptop", X509_V_ERR_PERMITTED_VIOLATION),
        std::pair("site-laptop", X509_V_OK), std::pair("printer.local", X509_V_OK)}) {
    CertificateText text{"forged", kNow - kDay, kNow + kDay, {}};
    text.extensions = {{NID_basic_constraints, "critical,CA:FALSE"},
                       {NID_ext_key_usage, "serverAuth"},
                       {NID_subject_key_identifier, "hash"},
                       {NID_authority_key_identifier, "keyid:always"},
                       {NID_subject_alt_name, std::string("DNS:") + name}};
    const auto key = NewKey();
    const auto forged = Certify(text, **key, *authority_key, authority.get());
    ASSERT_TRUE(forged.ok()) << forged.status();
    EXPECT_EQ(Verified(authority.get(), forged->get(), "", name, kNow), expected) << name;
  }
}

// A laptop that was renamed keeps the authority that tablets trust, whose certificates must not
// have a name that it may not sign for.
TEST_F(CertificateTest, StaysGoodWhenTheLaptopGetsAnotherName) {
  Keep({"site-laptop", {"192.168.1.5"}});
  EXPECT_FALSE(Keep({"office", {"192.168.1.5"}}).new_authority);
  const auto own = Read(CertificateIn(folder_));
  EXPECT_THAT(NamesOf(*own),
              ElementsAre("127.0.0.1", "192.168.1.5", "::1", "localhost", "office.local"));
  EXPECT_EQ(Verified(Read(AuthorityIn(folder_)).get(), own.get(), "192.168.1.5", "", kNow),
            X509_V_OK);
}

TEST_F(CertificateTest, KeysAreTheirOwnersAlone) {
  Keep({"", {}});
  for (const char* name : {"authority.key", "server.key"}) {
    struct stat about {};
    ASSERT_EQ(stat(File(name).c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777U, 0600U) << name;
    chmod(File(name).c_str(), 0640);
    const auto refused = KeepCertificate(folder_, {"", {}}, kNow);
    EXPECT_TRUE(absl::IsFailedPrecondition(refused.status()));
    EXPECT_THAT(std::string(refused.status().message()), HasSubstr("chmod 600"));
    chmod(File(name).c_str(), 0600);
  }
}

// Cut off between the writing of a key and of its certificate, and damaged.
TEST_F(CertificateTest, WhatACrashLeftIsMadeAnewAndWhatIsDamagedIsNamed) {
  const ServedCertificate first = Keep({"site-laptop", {}});
  std::filesystem::remove(CertificateIn(folder_));
  EXPECT_EQ(Keep({"site-laptop", {}}).authority_fingerprint, first.authority_fingerprint);
  const std::string other = PemOf(**NewKey());
  const std::string key = CertificateKeyIn(folder_);
  ASSERT_TRUE(store::ReplaceFile(key, key + ".new", other).ok());
  EXPECT_TRUE(Keep({"site-laptop", {}}).new_certificate);
  ASSERT_TRUE(store::ReplaceFile(AuthorityIn(folder_), key + ".new", "nonsense").ok());
  const auto damaged = KeepCertificate(folder_, {"site-laptop", {}}, kNow);
  EXPECT_TRUE(absl::IsFailedPrecondition(damaged.status()));
  EXPECT_THAT(std::string(damaged.status().message()), HasSubstr("move it away"));
}

}  // namespace
}  // namespace vantage::field
