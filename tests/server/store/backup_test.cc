// Copies that are made while the store is in use, and what verifying notices.
#include "server/store/backup.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
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

// No more than this can be written to a file.
class FileLimit {
 public:
  explicit FileLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

// Broken off, a copy is known for one that is not whole, and nothing starts from it; a restore is
// finished by the same command.
TEST_F(BackupTest, WhatWasBrokenOffIsKnown) {
  const std::string sha256 = Fill(In("data"));
  const std::string large =
      DiskStore::Open(In("data")).value()->PutBlob(std::string(200'000, 'x')).value();
  ASSERT_TRUE(BackUpStore(In("data"), In("copy")).ok());
  {
    const FileLimit limit(100'000);
    EXPECT_FALSE(BackUpStore(In("data"), In("half")).ok());
    EXPECT_FALSE(RestoreStore(In("copy"), In("cut")).ok());
  }
  for (const char* name : {"half", "cut"}) {
    SCOPED_TRACE(name);
    const auto refused = DiskStore::Open(In(name));
    EXPECT_TRUE(absl::IsFailedPrecondition(refused.status())) << refused.status();
    EXPECT_NE(refused.status().message().find("broken off"), absl::string_view::npos);
    EXPECT_NE(refused.status().message().find(name), absl::string_view::npos);
    EXPECT_FALSE(RestoreStore(In(name), In("elsewhere")).ok());
  }
  EXPECT_TRUE(absl::IsFailedPrecondition(RestoreStore(In("copy"), In("half")).status()));
  const auto finished = RestoreStore(In("copy"), In("cut"));
  ASSERT_TRUE(finished.ok()) << finished.status();
  const auto store = DiskStore::Open(In("cut"));
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ((*store)->GetBlob(sha256).value(), "scan 3 of b");
  EXPECT_EQ((*store)->BlobSize(large).value(), 200'000);
  EXPECT_TRUE(absl::IsFailedPrecondition(RestoreStore(In("copy"), In("cut")).status()));
}

TEST_F(BackupTest, ARestoreGoesOnAfterAnyFile) {
  const std::string sha256 = Fill(In("data"));
  ASSERT_TRUE(BackUpStore(In("data"), In("copy")).ok());
  ASSERT_TRUE(RestoreStore(In("copy"), In("whole")).ok());
  std::vector<fs::path> files;
  for (const auto& file : fs::recursive_directory_iterator(In("whole"))) {
    if (file.is_regular_file()) files.push_back(fs::relative(file.path(), In("whole")));
  }
  ASSERT_GE(files.size(), 8U);
  const std::string command =
      absl::StrCat("restore ", fs::path(In("copy")).lexically_normal().string());
  for (const fs::path& missing : files) {
    SCOPED_TRACE(missing);
    fs::remove_all(In("cut"));
    fs::copy(In("whole"), In("cut"), fs::copy_options::recursive);
    fs::remove(fs::path(In("cut")) / missing);
    std::ofstream(In("cut") + "/unfinished") << command << "\n";
    const auto refused = DiskStore::Open(In("cut"));
    EXPECT_TRUE(absl::IsFailedPrecondition(refused.status())) << refused.status();
    EXPECT_NE(refused.status().message().find("'vantaged " + command), absl::string_view::npos)
        << refused.status();
    EXPECT_FALSE(RestoreStore(In("cut"), In("elsewhere")).ok());
    // Another backup does not finish it.
    EXPECT_TRUE(absl::IsFailedPrecondition(RestoreStore(In("whole"), In("cut")).status()));
    const auto finished = RestoreStore(In("copy"), In("cut"));
    ASSERT_TRUE(finished.ok()) << finished.status();
    EXPECT_TRUE(VerifyStore(In("cut"))->faults.empty());
    const auto store = DiskStore::Open(In("cut"));
    ASSERT_TRUE(store.ok()) << store.status();
    EXPECT_EQ((*store)->GetBlob(sha256).value(), "scan 3 of b");
    EXPECT_EQ((*store)->Spools().value().size(), 1U);
  }
}

// A backup is another copy of the bytes, so that what damages a file damages one of the two.
TEST_F(BackupTest, SharesNoFileWithTheData) {
  Fill(In("data"));
  ASSERT_TRUE(BackUpStore(In("data"), In("copy")).ok());
  for (const auto& file : fs::recursive_directory_iterator(In("copy"))) {
    if (file.is_regular_file()) {
      EXPECT_EQ(fs::hard_link_count(file.path()), 1U) << file.path();
    }
  }
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
