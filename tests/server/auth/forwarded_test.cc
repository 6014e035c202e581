// What a proxy says of its clients: certificates and addresses.
#include "server/auth/forwarded.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "absl/strings/escaping.h"
#include "tests/server/fixture/certificates.h"

namespace vantage::auth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class CertificateNamesTest : public testing::Test {
 protected:
  std::string Issued(const std::string& name, const std::string& alternative = "") const {
    return fixture::DerInBase64(authority_.Issue(name, alternative).certificate);
  }
  const fixture::TestAuthority authority_{"forwarded"};
};

TEST_F(CertificateNamesTest, AlternativeNamesInOrderThenTheCommonName) {
  EXPECT_THAT(CertificateNames(Issued("office")).value(), ElementsAre("office"));
  EXPECT_THAT(CertificateNames(Issued("office", "DNS:b.example,DNS:a.example")).value(),
              ElementsAre("b.example", "a.example", "office"));
  EXPECT_THAT(CertificateNames(Issued("o",
                                      "email:a@b.example,URI:spiffe://x/y,IP:192.0.2.7,"
                                      "IP:2001:db8::7"))
                  .value(),
              ElementsAre("a@b.example", "spiffe://x/y", "192.0.2.7", "2001:db8::7", "o"));
}

// Nobody is known by a registered identifier.
TEST_F(CertificateNamesTest, OtherKindsAreLeftOut) {
  EXPECT_THAT(CertificateNames(Issued("office", "RID:1.2.3.4,DNS:office.example")).value(),
              ElementsAre("office.example", "office"));
}

TEST_F(CertificateNamesTest, WhatIsNoCertificateIsRefusedAndNotQuoted) {
  for (const char* bad : {"", "secret", "c2VjcmV0", "!!!!", "MIIB"}) {
    const absl::Status status = CertificateNames(bad).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << bad;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("ecret")));
  }
}

// One byte changed or the end cut off: refused or read, and never anything worse.
TEST_F(CertificateNamesTest, DamagedCertificatesEndNothing) {
  std::string der;
  ASSERT_TRUE(absl::Base64Unescape(Issued("office", "DNS:office.example,IP:192.0.2.7"), &der));
  std::mt19937 random(7);
  int read = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string damaged = der;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    read += CertificateNames(absl::Base64Escape(damaged)).ok() ? 1 : 0;
  }
  EXPECT_GT(read, 0);  // in the signature, which is the proxy's to check
  EXPECT_LT(read, 5000);
  for (size_t size = 0; size < der.size(); ++size) {
    EXPECT_FALSE(CertificateNames(absl::Base64Escape(der.substr(0, size))).ok()) << size;
  }
  EXPECT_FALSE(CertificateNames(absl::Base64Escape(der + "x")).ok());
}

TEST(ClientAddressTest, IsWrittenAsGrpcWritesPeers) {
  EXPECT_EQ(ClientAddress("10.0.0.7"), "ipv4:10.0.0.7");
  EXPECT_EQ(ClientAddress("2001:DB8:0::7"), "ipv6:[2001:db8::7]");
  // One client is one address, however the proxy's own port was opened.
  EXPECT_EQ(ClientAddress("::ffff:10.0.0.7"), "ipv4:10.0.0.7");
  for (const char* bad :
       {"", "10.0.0", "10.0.0.7:80", "10.0.0.7, 10.0.0.8", "localhost", "unix:"}) {
    EXPECT_EQ(ClientAddress(bad), std::nullopt) << bad;
  }
}

}  // namespace
}  // namespace vantage::auth
