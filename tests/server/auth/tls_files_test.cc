// Certificates and keys that are renewed on disk, one file after the other.
#include "server/auth/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "absl/time/time.h"
#include "tests/server/fixture/certificates.h"

namespace vantage::auth {
namespace {

using testing::HasSubstr;

std::string Read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class TlsFilesTest : public testing::Test {
 protected:
  TlsFilesTest() {
    options_.tls_cert = testing::TempDir() + "/tls-cert.pem";
    options_.tls_key = testing::TempDir() + "/tls-key.pem";
    options_.tls_client_ca = testing::TempDir() + "/tls-ca.pem";
    fixture::WriteTestFile(options_.tls_cert, first_.certificate);
    fixture::WriteTestFile(options_.tls_key, first_.key);
    fixture::WriteTestFile(options_.tls_client_ca, authority_.certificate());
    auto opened = TlsFiles::Open(options_);
    EXPECT_TRUE(opened.ok()) << opened.status();
    if (opened.ok()) files_ = *std::move(opened);
  }

  bool Loaded(const fixture::CertifiedKey& pair) const {
    return Read(files_->certificate_path()) == pair.certificate &&
           Read(files_->key_path()) == pair.key;
  }

  const fixture::TestAuthority authority_{"tls files"};
  const fixture::CertifiedKey first_ = authority_.Issue("first");
  const fixture::CertifiedKey second_ = authority_.Issue("second");
  AccessOptions options_;
  std::unique_ptr<TlsFiles> files_;
};

TEST_F(TlsFilesTest, ANewPairIsLoadedOnceItFitsInWhicheverOrderItIsWritten) {
  ASSERT_TRUE(Loaded(first_));
  for (const bool key_first : {true, false}) {
    const fixture::CertifiedKey& before = key_first ? first_ : second_;
    const fixture::CertifiedKey& next = key_first ? second_ : first_;
    const std::string& one = key_first ? options_.tls_key : options_.tls_cert;
    const std::string& other = key_first ? options_.tls_cert : options_.tls_key;
    fixture::WriteTestFile(one, key_first ? next.key : next.certificate);
    EXPECT_THAT(std::string(files_->Refresh().status().message()),
                HasSubstr("is not the key of the certificate"));
    EXPECT_THAT(files_->fault(), HasSubstr("is not the key of the certificate"));
    EXPECT_TRUE(Loaded(before));
    fixture::WriteTestFile(other, key_first ? next.certificate : next.key);
    const absl::StatusOr<bool> changed = files_->Refresh();
    ASSERT_TRUE(changed.ok()) << changed.status();
    EXPECT_TRUE(*changed);
    EXPECT_EQ(files_->fault(), "");
    EXPECT_TRUE(Loaded(next));
    EXPECT_FALSE(*files_->Refresh());
  }
}

TEST_F(TlsFilesTest, WhatCannotBeUsedLeavesWhatWasLoaded) {
  const absl::Time expires = files_->expires();
  const fixture::CertifiedKey late = authority_.Issue("late", "", -absl::Minutes(1));
  const auto refused = [&](const std::string& file, const std::string& text) {
    const std::string before = Read(file);
    fixture::WriteTestFile(file, text);
    const absl::Status status = files_->Refresh().status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_TRUE(Loaded(first_));
    EXPECT_EQ(Read(files_->client_ca_path()), authority_.certificate());
    EXPECT_EQ(files_->expires(), expires);
    fixture::WriteTestFile(file, before);
    EXPECT_TRUE(files_->Refresh().ok());
    return std::string(status.message());
  };
  EXPECT_THAT(refused(options_.tls_cert, ""), HasSubstr("holds no certificate"));
  EXPECT_THAT(refused(options_.tls_key, "half a ke"), HasSubstr("holds no key"));
  EXPECT_THAT(refused(options_.tls_client_ca, "nothing"), HasSubstr("holds no certificate"));
  fixture::WriteTestFile(options_.tls_key, late.key);
  fixture::WriteTestFile(options_.tls_cert, late.certificate);
  EXPECT_THAT(std::string(files_->Refresh().status().message()), HasSubstr("has expired"));
  EXPECT_TRUE(Loaded(first_));
}

}  // namespace
}  // namespace vantage::auth
