#include "server/auth/callers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"

namespace vantage::auth {
namespace {

using ::testing::HasSubstr;

std::string HashOf(const std::string& token) {
  return absl::BytesToHexString(bytes::Sha256::Of(token));
}

// Role by role, as a table: what each lets its holder do.
TEST(Roles, EachAllowsItselfAndAdministratorsAllowAll) {
  for (const Role has : {Role::kRead, Role::kSubmit, Role::kPlan, Role::kAdminister}) {
    for (const Role needs : {Role::kRead, Role::kSubmit, Role::kPlan, Role::kAdminister}) {
      EXPECT_EQ(Roles().With(has).Allow(needs), has == needs || has == Role::kAdminister);
    }
    EXPECT_FALSE(Roles().Allow(has));
  }
}

TEST(CallerList, FindsCallersByWhatTheyShow) {
  const auto list = CallerList::Parse(absl::StrCat(
      "# who\n\ntablet museum submit,plan  token:", HashOf("secret"), " 2027-01-31T00:00:00Z\r\n",
      "\toffice - administer certificate:office.example  # the office\n",
      "proxy * read certificate:proxy"));
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->size(), 3U);
  const Caller* tablet = list->ByToken("secret");
  ASSERT_NE(tablet, nullptr);
  EXPECT_EQ(tablet->name, "tablet");
  EXPECT_EQ(tablet->tenant, "museum");
  EXPECT_TRUE(tablet->roles.Allow(Role::kPlan));
  EXPECT_FALSE(tablet->roles.Allow(Role::kRead));
  EXPECT_EQ(tablet->expires, absl::FromCivil(absl::CivilDay(2027, 1, 31), absl::UTCTimeZone()));
  const Caller* office = list->ByCertificate("office.example");
  ASSERT_NE(office, nullptr);
  EXPECT_EQ(office->tenant, "");
  EXPECT_FALSE(office->names_tenant);
  EXPECT_EQ(office->expires, absl::InfiniteFuture());
  EXPECT_TRUE(list->ByCertificate("proxy")->names_tenant);
  EXPECT_TRUE(list->any_proxy());
  // The hash is no token, nor is a name, nor nothing.
  for (const std::string& wrong : {HashOf("secret"), std::string("tablet"), std::string(),
                                   std::string("secret "), std::string("Secret")}) {
    EXPECT_EQ(list->ByToken(wrong), nullptr) << wrong;
  }
  EXPECT_EQ(list->ByCertificate("secret"), nullptr);
}

TEST(CallerList, WhatIsWrongIsNamedByItsLineAndNeverShown) {
  const std::string hash = HashOf("secret");
  const std::string good = absl::StrCat("a b read token:", hash);
  for (const std::string& bad :
       {std::string("a b read"), good + " 2027-01-31T00:00:00Z more", good + " tomorrow",
        "a b read,fly token:" + hash, "a b , token:" + hash, "a/b c read token:" + hash,
        "a ../c read token:" + hash, "a b read " + hash, "a b read token:" + hash.substr(1),
        "a b read token:" + hash.substr(1) + "g", std::string("a b read certificate:"),
        std::string(64, 'n') + " b read token:" + hash, good}) {
    const auto list = CallerList::Parse(absl::StrCat(good, "\n\n", bad, "\n"));
    ASSERT_FALSE(list.ok()) << bad;
    EXPECT_THAT(std::string(list.status().message()), HasSubstr("line 3: ")) << bad;
    EXPECT_EQ(list.status().message().find(hash.substr(1)), absl::string_view::npos);
  }
}

TEST(CallersFile, IsReadAgainWhenItChangesAndKeptWhenItCannotBe) {
  const std::string path = ::testing::TempDir() + "/callers";
  const auto write = [&](const std::string& text) {
    std::ofstream(path) << text;
    chmod(path.c_str(), 0600);
  };
  EXPECT_TRUE(absl::IsNotFound(CallersFile::Open(path + "-none").status()));
  write("a b read token:" + HashOf("one"));
  const auto file = CallersFile::Open(path);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_FALSE((*file)->Refresh().value());
  const std::shared_ptr<const CallerList> before = (*file)->list();
  write("a b read token:" + HashOf("two"));
  EXPECT_TRUE((*file)->Refresh().value());
  EXPECT_EQ((*file)->list()->ByToken("one"), nullptr);
  EXPECT_NE((*file)->list()->ByToken("two"), nullptr);
  EXPECT_NE(before->ByToken("one"), nullptr);  // whoever has it may finish with it

  write("nonsense");
  EXPECT_THAT(std::string((*file)->Refresh().status().message()), HasSubstr("line 1"));
  EXPECT_NE((*file)->list()->ByToken("two"), nullptr);
  write("a b read token:" + HashOf("three"));
  chmod(path.c_str(), 0622);
  EXPECT_TRUE(absl::IsPermissionDenied((*file)->Refresh().status()));
  EXPECT_EQ((*file)->list()->ByToken("three"), nullptr);
  std::remove(path.c_str());
  EXPECT_TRUE(absl::IsNotFound((*file)->Refresh().status()));
  EXPECT_NE((*file)->list()->ByToken("two"), nullptr);
}

TEST(Token, IsRandomAndKnownByItsHash) {
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const NewToken made = MakeToken();
    EXPECT_TRUE(seen.insert(made.token).second);
    EXPECT_GE(made.token.size(), 43U);  // 256 bits
    const auto list = CallerList::Parse("a b read " + made.credential);
    ASSERT_TRUE(list.ok()) << list.status();
    EXPECT_NE(list->ByToken(made.token), nullptr);
  }
}

}  // namespace
}  // namespace vantage::auth
