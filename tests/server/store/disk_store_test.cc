// What is on the disk after crashes, damage and a full disk.
#include "server/store/disk_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "server/store/backup.h"
#include "server/store/salvage.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

constexpr char kSpool[] = "sessions/a/uploads/upload-1";

storage::v1::LogEntry Entry(uint64_t sequence, const std::string& blob = "") {
  storage::v1::LogEntry entry;
  entry.set_format_version(kLogFormatVersion);
  entry.set_blob(blob);
  entry.mutable_event()->set_sequence(sequence);
  return entry;
}

std::string Contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void Write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

class DiskStoreTest : public testing::Test {
 protected:
  DiskStoreTest() {
    std::string name = testing::TempDir() + "/store-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~DiskStoreTest() override { fs::remove_all(folder_); }

  std::unique_ptr<DiskStore> Open() const {
    auto store = DiskStore::Open(folder_);
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  fs::path SpoolFile() const { return fs::path(folder_) / "spools/sessions.a.uploads.upload-1"; }

  // The records of the spool as a server that starts now finds them.
  std::vector<std::string> Found() const {
    std::vector<std::string> records;
    const absl::Status read = Open()->ReadSpool(kSpool, [&](absl::string_view record) {
      records.emplace_back(record);
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return records;
  }

  std::string folder_;
};

// More than are read at a time, on both sides of what was left out.
TEST_F(DiskStoreTest, WhatWasLeftOutStaysOut) {
  {
    const auto store = Open();
    for (uint64_t i = 1; i <= 900; ++i) ASSERT_TRUE(store->Append("a", Entry(i)).ok());
    storage::v1::LogEntry left_out = Entry(500);
    left_out.mutable_event()->mutable_events_left_out()->set_first_sequence(301);
    ASSERT_TRUE(store->Compact("a", {left_out}).ok());
  }
  const auto store = Open();
  const auto log = store->Read("a", 0, 1000).value();
  ASSERT_EQ(log.size(), 701U);
  EXPECT_EQ(log[300].event().sequence(), 500U);
  EXPECT_EQ(log[301].event().sequence(), 501U);
  ASSERT_TRUE(store->Append("a", Entry(901)).ok());
  const StoreReport report = VerifyStore(folder_).value();
  EXPECT_TRUE(report.faults.empty()) << report.faults[0];
  EXPECT_EQ(report.entries, 702);
  const Salvaged salvaged = SalvageSession(folder_, "a", folder_ + "/saved").value();
  EXPECT_TRUE(salvaged.faults.empty()) << salvaged.faults[0];
  EXPECT_EQ(salvaged.entries, 702);
}

TEST_F(DiskStoreTest, EverythingIsThereAgain) {
  std::string sha;
  {
    const auto store = Open();
    for (uint64_t i = 1; i <= 300; ++i) ASSERT_TRUE(store->Append("a", Entry(i)).ok());
    sha = store->PutBlob("scan").value();
    ASSERT_TRUE(store->AppendSpool(kSpool, "one").ok());
    ASSERT_TRUE(store->AppendSpool(kSpool, "two").ok());
  }
  const auto store = Open();
  EXPECT_EQ(store->Read("a", 0, 1000).value().size(), 300U);
  EXPECT_TRUE(store->Append("a", Entry(301)).ok());
  EXPECT_EQ(store->GetBlob(sha).value(), "scan");
  ASSERT_TRUE(store->AppendSpool(kSpool, "three").ok());
  std::string all;
  ASSERT_TRUE(store
                  ->ReadSpool(kSpool,
                              [&](absl::string_view record) {
                                all.append(record.data(), record.size());
                                return absl::OkStatus();
                              })
                  .ok());
  EXPECT_EQ(all, "onetwothree");
}

// A scan is kept in the file that its pieces came into, and found again and checked.
TEST_F(DiskStoreTest, AScanIsKeptAsItCame) {
  const std::string bytes(100'000, 'r');
  storage::v1::SpoolRecord record;
  record.mutable_piece()->set_data(bytes::ZstdCompress(bytes));
  record.mutable_piece()->set_compression(v1::COMPRESSION_ZSTD);
  record.mutable_piece()->set_uncompressed_size_bytes(static_cast<int64_t>(bytes.size()));
  const std::string sha = bytes::Sha256::Of(bytes);
  {
    const auto store = Open();
    ASSERT_TRUE(store->AppendSpool(kSpool, record.SerializeAsString()).ok());
    ASSERT_TRUE(store->SyncSpool(kSpool).ok());
    ASSERT_TRUE(store->PutSpool(kSpool, sha).ok());
    ASSERT_TRUE(store->DropSpool(kSpool).ok());
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(folder_) / "blobs")) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].extension(), ".pieces");
  EXPECT_LT(fs::file_size(files[0]), 1000U);
  EXPECT_TRUE(Open()->GetBlob(sha).value() == bytes);
  EXPECT_EQ(Open()->BlobSize(sha).value(), static_cast<int64_t>(fs::file_size(files[0])));
  const std::string sound = Contents(files[0]);
  for (size_t at = 0; at < sound.size(); ++at) {
    std::string damaged = sound;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    std::ofstream(files[0], std::ios::binary) << damaged;
    const absl::StatusOr<std::string> read = Open()->GetBlob(sha);
    // What of the record means nothing may change.
    if (read.ok()) {
      EXPECT_TRUE(*read == bytes) << at;
    } else {
      EXPECT_TRUE(absl::IsDataLoss(read.status())) << at << ": " << read.status();
    }
  }
  ASSERT_TRUE(Open()->KeepBlobs({}).ok());
  EXPECT_FALSE(fs::exists(files[0]));
}

// Without its logs nobody knows whose scans these are: they are not for the server to remove.
TEST_F(DiskStoreTest, ScansWithoutTheirLogsAreRefusedAndStay) {
  std::string sha;
  {
    const auto store = Open();
    ASSERT_TRUE(store->Append("a", Entry(1)).ok());
    sha = store->PutBlob("scan").value();
    ASSERT_TRUE(store->AppendSpool(kSpool, "one").ok());
    ASSERT_TRUE(store->SyncSpool(kSpool).ok());
  }
  const fs::path database = fs::path(folder_) / "logs.sqlite";
  const fs::path aside = fs::path(folder_) / "logs.sqlite.aside";
  fs::rename(database, aside);
  for (const bool empty_file : {false, true}) {
    SCOPED_TRACE(empty_file);
    if (empty_file) Write(database, "");
    for (const char* kept : {"blobs", "spools"}) {
      const auto refused = DiskStore::Open(folder_);
      EXPECT_TRUE(absl::IsFailedPrecondition(refused.status())) << refused.status();
      for (const std::string& named : {folder_, std::string("logs.sqlite"), std::string("restore")})
        EXPECT_TRUE(absl::StrContains(refused.status().message(), named)) << refused.status();
      // Either of the two suffices.
      fs::rename(fs::path(folder_) / kept, fs::path(folder_) / "elsewhere");
      EXPECT_FALSE(DiskStore::Open(folder_).ok()) << "without " << kept;
      fs::rename(fs::path(folder_) / "elsewhere", fs::path(folder_) / kept);
    }
    if (!empty_file) {
      EXPECT_FALSE(fs::exists(database)) << "nothing was begun";
    }
  }
  fs::rename(aside, database);
  EXPECT_EQ(Open()->GetBlob(sha).value(), "scan");
  EXPECT_EQ(Open()->Spools().value().size(), 1U);
}

TEST_F(DiskStoreTest, OneServerAtATime) {
  const auto store = Open();
  const auto second = DiskStore::Open(folder_);
  EXPECT_TRUE(absl::IsFailedPrecondition(second.status())) << second.status();
}

// A power cut leaves any beginning of the record that was being written, or zeros in its place.
TEST_F(DiskStoreTest, ARecordThatWasBeingWrittenNeverCame) {
  {
    const auto store = Open();
    ASSERT_TRUE(store->AppendSpool(kSpool, "first").ok());
    ASSERT_TRUE(store->AppendSpool(kSpool, "second").ok());
    ASSERT_TRUE(store->AppendSpool(kSpool, "and the last one").ok());
  }
  const std::string whole = Contents(SpoolFile());
  const size_t last = whole.find("and the last one") - 12;
  for (size_t size = last; size < whole.size(); ++size) {
    for (const bool zeros : {false, true}) {
      SCOPED_TRACE(testing::Message() << size << " bytes, zeros " << zeros);
      std::string torn = whole.substr(0, size);
      if (zeros) torn.resize(whole.size(), '\0');
      Write(SpoolFile(), torn);
      ASSERT_EQ(Found(), (std::vector<std::string>{"first", "second"}));
      {
        const auto store = Open();
        ASSERT_TRUE(store->AppendSpool(kSpool, "again").ok());
      }
      ASSERT_EQ(Found(), (std::vector<std::string>{"first", "second", "again"}));
    }
  }
}

TEST_F(DiskStoreTest, DamageIsNoticed) {
  std::string sha;
  {
    const auto store = Open();
    ASSERT_TRUE(store->Append("a", Entry(1, "marked entry")).ok());
    ASSERT_TRUE(store->Append("a", Entry(2)).ok());
    ASSERT_TRUE(store->Append("b", Entry(1)).ok());
    ASSERT_TRUE(store->AppendSpool(kSpool, "first").ok());
    ASSERT_TRUE(store->AppendSpool(kSpool, "second").ok());
    sha = store->PutBlob("the bytes of a scan").value();
  }
  const std::string name = absl::BytesToHexString(sha);
  const fs::path blob = fs::path(folder_) / "blobs" / name.substr(0, 2) / name;
  Write(blob, "the bytes of a scam");
  std::string spool = Contents(SpoolFile());
  spool[spool.find("first")] = 'F';
  Write(SpoolFile(), spool);
  const fs::path logs = fs::path(folder_) / "logs.sqlite";
  std::string database = Contents(logs);
  const size_t marked = database.find("marked entry");
  ASSERT_NE(marked, std::string::npos);
  database[marked] = 'M';
  Write(logs, database);

  const auto store = Open();
  EXPECT_TRUE(absl::IsDataLoss(store->GetBlob(sha).status()));
  // Its sender has the rest of an upload still, and is asked for it.
  size_t records = 0;
  EXPECT_TRUE(store
                  ->ReadSpool(kSpool,
                              [&](absl::string_view) {
                                ++records;
                                return absl::OkStatus();
                              })
                  .ok());
  EXPECT_EQ(records, 0U);
  EXPECT_TRUE(absl::IsDataLoss(store->Read("a", 0, 10).status()));
  EXPECT_TRUE(store->Read("b", 0, 10).ok());
}

TEST_F(DiskStoreTest, WhatIsNotOursIsRefused) {
  Open();
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ + "/logs.sqlite").c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "PRAGMA user_version = 99", nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  const auto newer = DiskStore::Open(folder_);
  EXPECT_TRUE(absl::IsFailedPrecondition(newer.status())) << newer.status();
  EXPECT_TRUE(absl::StrContains(newer.status().message(), "99"));

  fs::remove(folder_ + "/logs.sqlite");
  Write(folder_ + "/logs.sqlite", std::string(5000, 'x'));
  EXPECT_TRUE(absl::IsDataLoss(DiskStore::Open(folder_).status()));

  Write(folder_ + "/file", "");
  EXPECT_FALSE(DiskStore::Open(folder_ + "/file").ok());
}

TEST_F(DiskStoreTest, HalfWrittenAndUnheldBlobsGo) {
  std::string kept;
  {
    const auto store = Open();
    kept = store->PutBlob("kept").value();
    ASSERT_TRUE(store->PutBlob("orphan").ok());
  }
  Write(fs::path(folder_) / "blobs/unfinished", "half");
  const auto store = Open();
  ASSERT_TRUE(store->KeepBlobs({{kept, 1}}).ok());
  int files = 0;
  for (const auto& file : fs::recursive_directory_iterator(fs::path(folder_) / "blobs")) {
    files += file.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 1);
  EXPECT_EQ(store->GetBlob(kept).value(), "kept");
}

// A limit on the size of files stands in for a full disk: the same writes fail, half done.
TEST_F(DiskStoreTest, WithoutRoomNothingIsLostAndItGoesOnAfterwards) {
  const auto store = Open();
  ASSERT_TRUE(store->Append("a", Entry(1)).ok());
  ASSERT_TRUE(store->AppendSpool(kSpool, "first").ok());
  const std::string small = store->PutBlob("small").value();
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  const absl::Status piece = store->AppendSpool(kSpool, std::string(9000, 'x'));
  const absl::Status blob = store->PutBlob(std::string(9000, 'y')).status();
  const absl::Status entry = store->Append("a", Entry(2, std::string(9000, 'z')));
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_TRUE(absl::IsResourceExhausted(piece)) << piece;
  EXPECT_TRUE(absl::IsResourceExhausted(blob)) << blob;
  EXPECT_FALSE(entry.ok());  // SQLite reports an I/O error here

  EXPECT_EQ(store->GetBlob(small).value(), "small");
  ASSERT_TRUE(store->AppendSpool(kSpool, "second").ok());
  ASSERT_TRUE(store->PutBlob(std::string(9000, 'y')).ok());
  ASSERT_TRUE(store->Append("a", Entry(2, std::string(9000, 'z'))).ok());
  std::vector<std::string> records;
  ASSERT_TRUE(store
                  ->ReadSpool(kSpool,
                              [&](absl::string_view record) {
                                records.emplace_back(record);
                                return absl::OkStatus();
                              })
                  .ok());
  EXPECT_EQ(records, (std::vector<std::string>{"first", "second"}));
  EXPECT_EQ(store->Read("a", 0, 10).value().size(), 2U);
}

}  // namespace
}  // namespace vantage::store
