#include "server/field/devices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/auth/callers.h"
#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

const absl::Time kPairedAt = absl::FromUnixSeconds(1'800'000'000);

class DevicesTest : public ::testing::Test {
 protected:
  DevicesTest() {
    std::string name = ::testing::TempDir() + "/devices-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~DevicesTest() override { std::filesystem::remove_all(folder_); }

  // As the server reads the file.
  std::shared_ptr<const auth::CallerList> Callers() const {
    const auto file = auth::CallersFile::Open(Devices(folder_).file());
    EXPECT_TRUE(file.ok()) << file.status();
    return file.ok() ? (*file)->list() : nullptr;
  }

  std::string folder_;
};

TEST_F(DevicesTest, EachHasATokenOfItsOwnThatTheServerKnowsUntilItIsRevoked) {
  Devices devices(folder_);
  EXPECT_THAT(*devices.List(), IsEmpty());
  const auto first = devices.Pair({"tablet-1"}, kPairedAt);
  const auto second = devices.Pair({"tablet-2", "read", absl::Hours(48)}, kPairedAt);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_NE(*first, *second);
  const auth::Caller* tablet = Callers()->ByToken(*first);
  ASSERT_NE(tablet, nullptr);
  EXPECT_EQ(tablet->name, "tablet-1");
  EXPECT_EQ(tablet->tenant, "");
  EXPECT_TRUE(tablet->roles.Allow(auth::Role::kSubmit));
  EXPECT_FALSE(tablet->roles.Allow(auth::Role::kAdminister));
  EXPECT_EQ(Callers()->ByToken(*second)->expires, kPairedAt + absl::Hours(48));
  const auto listed = devices.List();
  ASSERT_THAT(*listed, SizeIs(2));
  EXPECT_EQ((*listed)[1].name, "tablet-2");
  EXPECT_EQ((*listed)[1].roles, "read");
  EXPECT_EQ((*listed)[1].expires, kPairedAt + absl::Hours(48));

  ASSERT_TRUE(devices.Revoke("tablet-1").ok());
  EXPECT_EQ(Callers()->ByToken(*first), nullptr);
  EXPECT_NE(Callers()->ByToken(*second), nullptr);
  EXPECT_TRUE(absl::IsNotFound(devices.Revoke("tablet-1")));
}

TEST_F(DevicesTest, NoTokenIsKeptAndTheFileIsItsOwners) {
  Devices devices(folder_);
  const std::string token = *devices.Pair({"tablet-1"}, kPairedAt);
  EXPECT_THAT(*store::ReadWhole(devices.file()), Not(HasSubstr(token)));
  struct stat about {};
  ASSERT_EQ(stat(devices.file().c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
}

TEST_F(DevicesTest, ANameIsTakenOverOnlyWhereThatIsSaid) {
  Devices devices(folder_);
  const std::string lost = *devices.Pair({"tablet-1"}, kPairedAt);
  EXPECT_TRUE(absl::IsAlreadyExists(devices.Pair({"tablet-1"}, kPairedAt).status()));
  EXPECT_NE(Callers()->ByToken(lost), nullptr);
  Pairing again{"tablet-1"};
  again.replace = true;
  const auto found = devices.Pair(again, kPairedAt);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(Callers()->ByToken(lost), nullptr);
  EXPECT_NE(Callers()->ByToken(*found), nullptr);
  EXPECT_THAT(*devices.List(), SizeIs(1));
}

TEST_F(DevicesTest, TheLaptopHasATokenThatNoDeviceCanTakeOrGive) {
  Devices devices(folder_);
  const auto path = devices.RenewLaptop();
  ASSERT_TRUE(path.ok()) << path.status();
  const std::string before(absl::StripAsciiWhitespace(*store::ReadWhole(*path)));
  EXPECT_TRUE(Callers()->ByToken(before)->roles.Allow(auth::Role::kAdminister));
  ASSERT_TRUE(devices.Pair({"tablet-1"}, kPairedAt).ok());
  EXPECT_THAT(*devices.List(), SizeIs(1));
  EXPECT_FALSE(devices.Pair({kLaptop}, kPairedAt).ok());
  EXPECT_FALSE(devices.Revoke(kLaptop).ok());
  ASSERT_TRUE(devices.RenewLaptop().ok());
  EXPECT_EQ(Callers()->ByToken(before), nullptr);
  EXPECT_EQ(Callers()->size(), 2U);
}

TEST_F(DevicesTest, NothingThatIsNoNameOrNoRoleGetsIntoTheFile) {
  Devices devices(folder_);
  ASSERT_TRUE(devices.Pair({"tablet-1"}, kPairedAt).ok());
  const std::string before = *store::ReadWhole(devices.file());
  for (const Pairing& wrong :
       {Pairing{""}, Pairing{"a b"}, Pairing{"a\nproxy * administer token:0"}, Pairing{"#"},
        Pairing{"a # b"}, Pairing{std::string(64, 'a')}, Pairing{"a", "fly"}, Pairing{"a", ""}}) {
    EXPECT_TRUE(absl::IsInvalidArgument(devices.Pair(wrong, kPairedAt).status())) << wrong.name;
  }
  EXPECT_EQ(*store::ReadWhole(devices.file()), before);
}

// What a person wrote into the file stays; a file with a fault is not written over.
TEST_F(DevicesTest, LinesOfOthersStay) {
  Devices devices(folder_);
  ASSERT_TRUE(devices.Pair({"tablet-1"}, kPairedAt).ok());
  const std::string before = *store::ReadWhole(devices.file());
  const std::string more =
      before + "# the office\noffice - administer certificate:office.example\n";
  ASSERT_TRUE(store::ReplaceFile(devices.file(), devices.file() + ".new", more).ok());
  ASSERT_TRUE(devices.Pair({"tablet-2"}, kPairedAt).ok());
  ASSERT_TRUE(devices.Revoke("tablet-2").ok());
  EXPECT_EQ(*store::ReadWhole(devices.file()), more);
  ASSERT_TRUE(
      store::ReplaceFile(devices.file(), devices.file() + ".new", more + "nonsense\n").ok());
  EXPECT_THAT(std::string(devices.Revoke("tablet-1").message()), HasSubstr("line 5"));
  EXPECT_EQ(*store::ReadWhole(devices.file()), more + "nonsense\n");
}

// Two people pair at once, each from a terminal: nobody's device is lost.
TEST_F(DevicesTest, ManyMayPairAtOnce) {
  std::vector<std::thread> pairing;
  std::atomic<int> failed{0};
  constexpr int kPeople = 8;
  pairing.reserve(kPeople);
  for (int i = 0; i < kPeople; ++i) {
    pairing.emplace_back([this, i, &failed] {
      for (int k = 0; k < 4; ++k) {
        if (!Devices(folder_).Pair({absl::StrCat("tablet-", i, "-", k)}, kPairedAt).ok()) ++failed;
      }
    });
  }
  for (std::thread& one : pairing) one.join();
  EXPECT_EQ(failed, 0);
  EXPECT_THAT(*Devices(folder_).List(), SizeIs(32));
}

}  // namespace
}  // namespace vantage::field
