// What is read of a session whose log and scans are damaged.
#include "server/store/salvage.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/store/disk_store.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

std::string TextOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class SalvageTest : public testing::Test {
 protected:
  SalvageTest() {
    std::string name = testing::TempDir() + "/salvage-XXXXXX";
    folder_ = mkdtemp(name.data());
    data_ = folder_ + "/data";
    to_ = folder_ + "/to";
    const auto store = DiskStore::Open(data_).value();
    for (uint64_t i = 1; i <= 4; ++i) {
      storage::v1::LogEntry entry;
      entry.set_format_version(kLogFormatVersion);
      entry.mutable_event()->set_sequence(i);
      v1::Scan& scan = *entry.mutable_event()->mutable_scan_received()->mutable_scan();
      scan.set_name(absl::StrCat("sessions/museum/scans/scan-", i));
      sha256_[i - 1] = store->PutBlob(absl::StrCat("range image ", i)).value();
      scan.set_sha256(sha256_[i - 1]);
      entry.set_blob(sha256_[i - 1]);
      EXPECT_TRUE(store->Append("museum", entry).ok());
      EXPECT_TRUE(store->Append("other", entry).ok());
    }
    storage::v1::SpoolRecord record;
    record.mutable_piece()->set_data("the beginning");
    EXPECT_TRUE(
        store->AppendSpool("sessions/museum/uploads/upload-5", record.SerializeAsString()).ok());
    EXPECT_TRUE(
        store->AppendSpool("sessions/other/uploads/upload-5", record.SerializeAsString()).ok());
  }
  ~SalvageTest() override { fs::remove_all(folder_); }

  void Run(const char* sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open((data_ + "/logs.sqlite").c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(database);
  }

  std::string folder_;
  std::string data_;
  std::string to_;
  std::string sha256_[4];
};

TEST_F(SalvageTest, AroundWhatIsDamagedEverythingIsRead) {
  Run("UPDATE log SET entry = x'0102' WHERE session = 'museum' AND sequence = 2");
  const std::string lost = absl::BytesToHexString(sha256_[2]);
  fs::remove(fs::path(data_) / "blobs" / lost.substr(0, 2) / lost);
  const auto running = DiskStore::Open(data_).value();  // beside a server
  ASSERT_TRUE(absl::IsDataLoss(running->Read("museum", 0, 10).status()));
  const auto salvaged = SalvageSession(data_, "museum", to_);
  ASSERT_TRUE(salvaged.ok()) << salvaged.status();
  EXPECT_EQ(salvaged->entries, 3);
  EXPECT_EQ(salvaged->scans, 2);
  EXPECT_EQ(salvaged->uploads, 1);
  ASSERT_EQ(salvaged->faults.size(), 2U);
  EXPECT_TRUE(absl::StrContains(salvaged->faults[0], "entry 2")) << salvaged->faults[0];
  EXPECT_TRUE(absl::StrContains(salvaged->faults[1], lost)) << salvaged->faults[1];
  EXPECT_EQ(TextOf(to_ + "/scans/scan-1.vrim"), "range image 1");
  EXPECT_EQ(TextOf(to_ + "/scans/scan-4.vrim"), "range image 4");
  EXPECT_FALSE(fs::exists(to_ + "/scans/scan-3.vrim"));
  EXPECT_EQ(TextOf(to_ + "/uploads/upload-5.vrim"), "the beginning");
  const std::string log = TextOf(to_ + "/log.jsonl");
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 3);
  EXPECT_TRUE(absl::StrContains(log, "sessions/museum/scans/scan-4"));
}

TEST_F(SalvageTest, AnEntryThatIsMissingIsNamed) {
  Run("DELETE FROM log WHERE session = 'museum' AND sequence = 1");
  const auto salvaged = SalvageSession(data_, "museum", to_);
  ASSERT_TRUE(salvaged.ok()) << salvaged.status();
  EXPECT_EQ(salvaged->entries, 3);
  ASSERT_EQ(salvaged->faults.size(), 1U);
  EXPECT_TRUE(absl::StrContains(salvaged->faults[0], "entry 1")) << salvaged->faults[0];
}

TEST_F(SalvageTest, WritesOverNothingAndFindsOnlyWhatIsThere) {
  EXPECT_TRUE(absl::IsNotFound(SalvageSession(data_, "nobody", to_).status()));
  EXPECT_FALSE(fs::exists(to_));
  EXPECT_FALSE(SalvageSession(folder_ + "/nowhere", "museum", to_).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(SalvageSession(data_, "museum", data_).status()));
}

TEST_F(SalvageTest, RemovedItIsGoneAndTheOthersStay) {
  {
    const auto running = DiskStore::Open(data_).value();
    EXPECT_TRUE(absl::IsFailedPrecondition(RemoveSession(data_, "museum")));
  }
  EXPECT_TRUE(absl::IsNotFound(RemoveSession(folder_ + "/nowhere", "museum")));
  EXPECT_FALSE(fs::exists(folder_ + "/nowhere"));
  ASSERT_TRUE(RemoveSession(data_, "museum").ok());
  EXPECT_TRUE(absl::IsNotFound(RemoveSession(data_, "museum")));
  const auto store = DiskStore::Open(data_).value();
  EXPECT_EQ(store->Sessions().value(), std::vector<std::string>{"other"});
  EXPECT_EQ(store->Read("other", 0, 10).value().size(), 4U);
}

}  // namespace
}  // namespace vantage::store
