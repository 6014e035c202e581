// Copies that are made while the store is in use, and what verifying notices.
#include "server/store/backup.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "server/store/disk_store.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

storage::v1::LogEntry BackupEntry(uint64_t sequence, const std::string& blob) {
  storage::v1::LogEntry entry;
  entry.set_format_version(kLogFormatVersion);
  entry.set_blob(blob);
  entry.mutable_event()->set_sequence(sequence);
  entry.mutable_event()->mutable_scan_received();
  return entry;
}

class BackupTest : public testing::Test {
 protected:
  BackupTest() {
    std::string name = testing::TempDir() + "/backup-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~BackupTest() override { fs::remove_all(folder_); }
  std::string In(const std::string& name) const { return absl::StrCat(folder_, "/", name); }

  // Two sessions of a few scans, and an upload under way; the SHA-256 of the last scan.
  std::string Fill(const std::string& folder) const {
    const auto store = DiskStore::Open(folder).value();
    std::string sha256;
    for (const char* session : {"a", "b"}) {
      for (uint64_t i = 1; i <= 3; ++i) {
        sha256 = store->PutBlob(absl::StrCat("scan ", i, " of ", session)).value();
        EXPECT_TRUE(store->Append(session, BackupEntry(i, sha256)).ok());
      }
    }
    EXPECT_TRUE(store->AppendSpool("sessions/a/uploads/upload-4", "the first piece").ok());
    EXPECT_TRUE(store->AppendSpool("sessions/a/uploads/upload-4", "the second piece").ok());
    return sha256;
  }

  std::string folder_;
};

TEST_F(BackupTest, RestoredItIsAsItWas) {
  const std::string sha256 = Fill(In("data"));
  const auto backup = BackUpStore(In("data"), In("copy"));
  ASSERT_TRUE(backup.ok()) << backup.status();
  EXPECT_EQ(backup->sessions, 2);
  EXPECT_EQ(backup->entries, 6);
  EXPECT_EQ(backup->blobs, 6);
  EXPECT_EQ(backup->uploads, 1);
  fs::remove_all(In("data"));
  ASSERT_TRUE(RestoreStore(In("copy"), In("data")).ok());
  const auto store = DiskStore::Open(In("data")).value();
  EXPECT_EQ(store->Sessions().value(), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(store->Read("b", 0, 10).value().size(), 3U);
  EXPECT_EQ(store->GetBlob(sha256).value(), "scan 3 of b");
  EXPECT_EQ(store->Spools().value().size(), 1U);
  EXPECT_TRUE(store->Append("b", BackupEntry(4, "")).ok());
}

// Scans come and sessions go while it is copied: each copy is of one moment, and sound.
TEST_F(BackupTest, IsMadeWhileTheServerWorks) {
  const auto store = DiskStore::Open(In("data")).value();
  std::atomic<bool> stop{false};
  std::thread server([&] {
    for (int job = 0; !stop; ++job) {
      const std::string session = absl::StrCat("job-", job % 3);
      std::vector<std::string> held;
      for (uint64_t i = 1; i <= 4; ++i) {
        held.push_back(store->PutBlob(absl::StrCat("scan ", i, " of job ", job)).value());
        ASSERT_TRUE(store->Append(session, BackupEntry(i, held.back())).ok());
      }
      ASSERT_TRUE(store->Drop(session).ok());
      for (const std::string& sha256 : held) ASSERT_TRUE(store->ReleaseBlob(sha256).ok());
    }
  });
  for (int i = 0; i < 20; ++i) {
    const auto copy = BackUpStore(In("data"), In(absl::StrCat("copy-", i)));
    EXPECT_TRUE(copy.ok()) << copy.status();
  }
  stop = true;
  server.join();
}

TEST_F(BackupTest, VerifyingNamesEveryFault) {
  const std::string sha256 = Fill(In("data"));
  EXPECT_TRUE(VerifyStore(In("data"))->faults.empty());
  const std::string name = absl::BytesToHexString(sha256);
  const fs::path blob = fs::path(In("data")) / "blobs" / name.substr(0, 2) / name;
  std::ofstream(blob, std::ios::trunc) << "something else";
  ASSERT_EQ(VerifyStore(In("data"))->faults.size(), 1U);
  EXPECT_NE(VerifyStore(In("data"))->faults[0].find(name), std::string::npos);
  fs::remove(blob);
  EXPECT_NE(VerifyStore(In("data"))->faults.at(0).find("missing"), std::string::npos);
  EXPECT_TRUE(absl::IsDataLoss(BackUpStore(In("data"), In("copy")).status()));
  EXPECT_TRUE(absl::IsDataLoss(RestoreStore(In("data"), In("other")).status()));

  const fs::path spool = fs::path(In("data")) / "spools/sessions.a.uploads.upload-4";
  std::fstream(spool, std::ios::in | std::ios::out | std::ios::binary).seekp(14) << "X";
  EXPECT_EQ(VerifyStore(In("data"))->faults.size(), 2U);
}

TEST_F(BackupTest, NeverWritesOverAnything) {
  Fill(In("data"));
  Fill(In("other"));
  EXPECT_TRUE(absl::IsFailedPrecondition(BackUpStore(In("data"), In("other")).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(RestoreStore(In("data"), In("other")).status()));
  EXPECT_TRUE(absl::IsNotFound(VerifyStore(In("nowhere")).status()));
  EXPECT_TRUE(absl::IsNotFound(BackUpStore(In("nowhere"), In("copy")).status()));
}

}  // namespace
}  // namespace vantage::store
