#include "server/field/field_site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

#include "server/field/greeting.h"
#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const absl::Time kOpenedAt = absl::FromUnixSeconds(1'800'000'000);

class FieldSiteTest : public ::testing::Test {
 protected:
  FieldSiteTest() {
    std::string name = ::testing::TempDir() + "/site-XXXXXX";
    data_ = mkdtemp(name.data());
  }
  ~FieldSiteTest() override { std::filesystem::remove_all(data_); }

  absl::StatusOr<std::unique_ptr<FieldSite>> Open(const std::string& address = "") {
    return FieldSite::Open(
        {data_, address}, kOpenedAt, [this] { return network_; }, "site-laptop");
  }
  void Join(const std::string& address) {
    network_ = {{"wlan0", address, true, false, Medium::kWireless}};
  }

  std::string data_;
  std::vector<InterfaceAddress> network_;
};

TEST_F(FieldSiteTest, FollowsTheNetworkThatTheLaptopIsIn) {
  Join("192.168.1.5");
  const auto site = Open();
  ASSERT_TRUE(site.ok()) << site.status();
  ASSERT_TRUE((*site)->Begin(7443).ok());
  EXPECT_EQ(*ServedPage((*site)->folder()), "https://192.168.1.5:7443");
  auto news = (*site)->Look(kOpenedAt);
  ASSERT_TRUE(news.ok());
  EXPECT_FALSE(news->addresses || news->certificate);
  Join("10.42.0.1");
  news = (*site)->Look(kOpenedAt);
  ASSERT_TRUE(news.ok());
  EXPECT_TRUE(news->addresses && news->certificate);
  EXPECT_EQ(*ServedPage((*site)->folder()), "https://10.42.0.1:7443");
  const std::string text = AddressText(**site, "vantaged field");
  EXPECT_THAT(text, HasSubstr("https://10.42.0.1:7443/"));
  EXPECT_THAT(text, HasSubstr("Before, it was at https://192.168.1.5:7443/"));
}

// A disk that was full for a while: what could not be kept is done, and told, with the next look.
TEST_F(FieldSiteTest, WhatCouldNotBeKeptIsDoneWithTheNextLook) {
  Join("192.168.1.5");
  const auto site = Open();
  ASSERT_TRUE(site.ok()) << site.status();
  ASSERT_TRUE((*site)->Begin(7443).ok());
  Join("10.42.0.1");
  const std::string in_the_way = CertificateKeyIn((*site)->folder()) + ".new";
  std::filesystem::create_directory(in_the_way);
  EXPECT_FALSE((*site)->Look(kOpenedAt).ok());
  EXPECT_EQ((*site)->page(), "https://192.168.1.5:7443");
  std::filesystem::remove(in_the_way);
  const auto news = (*site)->Look(kOpenedAt);
  ASSERT_TRUE(news.ok()) << news.status();
  EXPECT_TRUE(news->addresses && news->certificate);
  EXPECT_EQ((*site)->page(), "https://10.42.0.1:7443");
}

TEST_F(FieldSiteTest, SaysInWordsThatThereIsNoNetwork) {
  const auto site = Open();
  ASSERT_TRUE(site.ok()) << site.status();
  ASSERT_TRUE((*site)->Begin(7443).ok());
  EXPECT_EQ((*site)->page(), "https://127.0.0.1:7443");
  EXPECT_THAT(AddressText(**site, "vantaged field"), HasSubstr("no network"));
  Join("192.168.1.5");
  ASSERT_TRUE((*site)->Look(kOpenedAt).ok());
  EXPECT_THAT(AddressText(**site, "vantaged field"), Not(HasSubstr("no network")));
}

TEST_F(FieldSiteTest, KeepsToTheAddressThatItWasGiven) {
  Join("192.168.1.5");
  const auto site = Open("127.0.0.1");
  ASSERT_TRUE(site.ok()) << site.status();
  EXPECT_EQ((*site)->page_listen(), "127.0.0.1:7443");
  Join("192.168.1.6");
  EXPECT_FALSE((*site)->Look(kOpenedAt)->addresses);
  EXPECT_EQ((*site)->page(), "https://127.0.0.1:7443");
  EXPECT_TRUE(absl::IsInvalidArgument(Open("laptop").status()));
}

TEST_F(FieldSiteTest, OneServesWithAFolderAtATime) {
  auto site = Open();
  ASSERT_TRUE(site.ok()) << site.status();
  const std::string folder = (*site)->folder();
  EXPECT_TRUE(absl::IsAlreadyExists(Open().status()));
  ASSERT_TRUE((*site)->Begin(7443).ok());
  // Asking takes it from nobody.
  EXPECT_TRUE(ServedPage(folder).ok());
  EXPECT_TRUE(ServedPage(folder).ok());
  site->reset();
  EXPECT_TRUE(absl::IsFailedPrecondition(ServedPage(folder).status()));
  EXPECT_EQ(LastPage(folder), "https://127.0.0.1:7443");
  EXPECT_TRUE(Open().ok());
}

TEST_F(FieldSiteTest, TheFolderIsItsOwnersAlone) {
  std::filesystem::create_directories(FieldFolderOf(data_));
  chmod(FieldFolderOf(data_).c_str(), 0755);
  ASSERT_TRUE(Open().ok());
  struct stat about {};
  ASSERT_EQ(stat(FieldFolderOf(data_).c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0700U);
}

TEST(ShellQuoted, IsReadByAShellAsItWas) {
  EXPECT_EQ(ShellQuoted("unix:/home/ann/a-b_c.d/x"), "unix:/home/ann/a-b_c.d/x");
  for (const std::string argument : {"", "a b", "it's", "$HOME", "a;b", "ä", "*"}) {
    const std::string command = "test " + ShellQuoted(argument) + " = \"$TOLD\"";
    ASSERT_EQ(setenv("TOLD", argument.c_str(), 1), 0);
    EXPECT_EQ(std::system(command.c_str()), 0) << argument;  // NOLINT: that is what is tested
  }
}

}  // namespace
}  // namespace vantage::field
