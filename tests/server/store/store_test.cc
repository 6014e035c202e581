// Tests that every kind of store must pass.
#include "server/store/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "server/store/disk_store.h"
#include "server/store/left_out.h"
#include "server/store/memory_store.h"

namespace vantage::store {
namespace {

using ::testing::ElementsAre;

storage::v1::LogEntry NumberedEntry(uint64_t sequence) {
  storage::v1::LogEntry entry;
  entry.set_format_version(kLogFormatVersion);
  entry.mutable_event()->set_sequence(sequence);
  return entry;
}

std::vector<std::string> Records(const Store& store, const std::string& spool) {
  std::vector<std::string> records;
  const absl::Status read = store.ReadSpool(spool, [&](absl::string_view record) {
    records.emplace_back(record);
    return absl::OkStatus();
  });
  EXPECT_TRUE(read.ok()) << read;
  return records;
}

class StoreTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::string(GetParam()) == "memory") {
      store_ = std::make_unique<MemoryStore>(1 << 20);
      return;
    }
    std::string name = testing::TempDir() + "/store-XXXXXX";
    folder_ = mkdtemp(name.data());
    store_ = DiskStore::Open(folder_).value();
  }
  void TearDown() override {
    store_.reset();
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  std::string folder_;
  std::unique_ptr<Store> store_;
};

TEST_P(StoreTest, LogsAreOrderedAndFenced) {
  EXPECT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  EXPECT_TRUE(store_->Append("a", NumberedEntry(2)).ok());
  EXPECT_TRUE(absl::IsAborted(store_->Append("a", NumberedEntry(2))));
  EXPECT_TRUE(absl::IsAborted(store_->Append("a", NumberedEntry(4))));
  EXPECT_TRUE(absl::IsAborted(store_->Append("b", NumberedEntry(2))));
  const auto all = store_->Read("a", 0, 10).value();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1].event().sequence(), 2U);
  EXPECT_EQ(store_->Read("a", 1, 10).value().size(), 1U);
  EXPECT_EQ(store_->Read("a", 0, 1).value().size(), 1U);
  EXPECT_TRUE(store_->Read("a", 99, 10).value().empty());
  EXPECT_TRUE(absl::IsNotFound(store_->Read("c", 0, 1).status()));
  EXPECT_EQ(store_->Sessions().value(), std::vector<std::string>{"a"});
  EXPECT_TRUE(store_->Drop("a").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Drop("a")));
  EXPECT_TRUE(store_->Sessions().value().empty());
}

TEST_P(StoreTest, ADeletionIsRememberedWithItsRequest) {
  EXPECT_TRUE(store_->Deletions().value().empty());
  EXPECT_TRUE(absl::IsNotFound(store_->DropByRequest({"museum", "r", "a", {}})));
  EXPECT_TRUE(store_->Deletions().value().empty());
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  ASSERT_TRUE(store_->Append("b", NumberedEntry(1)).ok());
  const absl::Time time = absl::FromUnixSeconds(1'700'000'000);
  ASSERT_TRUE(store_->DropByRequest({"museum", "r", "a", time}).ok());
  ASSERT_TRUE(store_->DropByRequest({"", "s", "b", time}).ok());
  EXPECT_TRUE(store_->Sessions().value().empty());
  const std::vector<DeletionRecord> known = store_->Deletions().value();
  ASSERT_EQ(known.size(), 2U);
  EXPECT_EQ(known[0].tenant, "museum");
  EXPECT_EQ(known[0].request, "r");
  EXPECT_EQ(known[0].session, "a");
  EXPECT_EQ(known[0].time, time);
  EXPECT_EQ(known[1].session, "b");
}

TEST_P(StoreTest, ALogIsPutAsAWholeOrNotAtAll) {
  const auto spool = [&](const std::string& name, const std::vector<uint64_t>& sequences) {
    for (const uint64_t sequence : sequences) {
      ASSERT_TRUE(store_->AppendSpool(name, NumberedEntry(sequence).SerializeAsString()).ok());
    }
  };
  EXPECT_TRUE(absl::IsAborted(store_->PutLog("a", "nothing")));
  spool("gap", {1, 2, 4});
  EXPECT_TRUE(absl::IsAborted(store_->PutLog("a", "gap")));
  EXPECT_TRUE(absl::IsNotFound(store_->Read("a", 0, 9).status()));
  spool("whole", {1, 2, 3});
  ASSERT_TRUE(store_->PutLog("a", "whole").ok());
  EXPECT_EQ(store_->Read("a", 0, 9).value().size(), 3U);
  EXPECT_TRUE(absl::IsAborted(store_->PutLog("a", "whole"))) << "it has a log";
  EXPECT_TRUE(store_->Append("a", NumberedEntry(4)).ok());
  EXPECT_EQ(store_->Sessions().value(), std::vector<std::string>{"a"});
}

TEST_P(StoreTest, SnapshotsGoWithTheirLog) {
  const std::string blob(32, 'b');
  EXPECT_TRUE(absl::IsNotFound(store_->PutSnapshot("a", {1, 1, blob})));
  EXPECT_TRUE(store_->Snapshots("a").value().empty());
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  for (const uint64_t sequence : {5, 12, 9}) {
    ASSERT_TRUE(store_->PutSnapshot("a", {sequence, 3, blob}).ok());
  }
  ASSERT_TRUE(store_->PutSnapshot("a", {9, 4, std::string(32, 'c')}).ok());
  std::vector<SnapshotRecord> known = store_->Snapshots("a").value();
  ASSERT_EQ(known.size(), 3U);
  EXPECT_EQ(known[0].sequence, 12U);
  EXPECT_EQ(known[1].sequence, 9U);
  EXPECT_EQ(known[1].algorithm_version, 4U);
  EXPECT_EQ(known[1].blob, std::string(32, 'c'));
  EXPECT_EQ(known[2].sequence, 5U);
  EXPECT_TRUE(store_->DropSnapshot("a", 12).ok());
  EXPECT_TRUE(store_->DropSnapshot("a", 12).ok());
  EXPECT_EQ(store_->Snapshots("a").value().size(), 2U);
  EXPECT_TRUE(store_->Snapshots("b").value().empty());
  ASSERT_TRUE(store_->Drop("a").ok());
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  EXPECT_TRUE(store_->Snapshots("a").value().empty());
}

storage::v1::LogEntry StandsFor(uint64_t first, uint64_t last) {
  storage::v1::LogEntry entry = NumberedEntry(last);
  entry.mutable_event()->mutable_events_left_out()->set_first_sequence(first);
  return entry;
}

std::vector<std::pair<uint64_t, uint64_t>> Spans(const Store& store, uint64_t after,
                                                 size_t limit = 100) {
  std::vector<std::pair<uint64_t, uint64_t>> spans;
  const auto entries = store.Read("a", after, limit);
  EXPECT_TRUE(entries.ok()) << entries.status();
  if (!entries.ok()) return spans;
  for (const storage::v1::LogEntry& entry : *entries) {
    spans.emplace_back(FirstSequence(entry.event()), entry.event().sequence());
  }
  return spans;
}

TEST_P(StoreTest, ACompactedLogIsReadFromAnyPlace) {
  for (uint64_t i = 1; i <= 9; ++i) ASSERT_TRUE(store_->Append("a", NumberedEntry(i)).ok());
  ASSERT_TRUE(store_->Append("b", NumberedEntry(1)).ok());
  ASSERT_TRUE(store_->PutSnapshot("a", {5, 1, std::string(32, 'b')}).ok());
  ASSERT_TRUE(store_->BeginWork("a", "merge").ok());
  ASSERT_TRUE(store_->Compact("a", {StandsFor(2, 4), StandsFor(5, 5), StandsFor(7, 8)}).ok());
  using Span = std::pair<uint64_t, uint64_t>;
  EXPECT_THAT(Spans(*store_, 0),
              ElementsAre(Span(1, 1), Span(2, 4), Span(5, 5), Span(6, 6), Span(7, 8), Span(9, 9)));
  EXPECT_THAT(Spans(*store_, 1, 2), ElementsAre(Span(2, 4), Span(5, 5)));
  // Who was told 3 gets the one that stands for it and others.
  EXPECT_THAT(Spans(*store_, 3, 2), ElementsAre(Span(2, 4), Span(5, 5)));
  EXPECT_THAT(Spans(*store_, 8), ElementsAre(Span(9, 9)));
  // It goes on, is compacted again, and keeps what else belongs to it.
  ASSERT_TRUE(store_->Append("a", NumberedEntry(10)).ok());
  EXPECT_TRUE(absl::IsAborted(store_->Append("a", NumberedEntry(10))));
  ASSERT_TRUE(store_->Compact("a", {StandsFor(2, 5)}).ok());
  EXPECT_THAT(Spans(*store_, 0, 3), ElementsAre(Span(1, 1), Span(2, 5), Span(6, 6)));
  EXPECT_EQ(store_->Snapshots("a").value().size(), 1U);
  EXPECT_EQ(store_->BeginWork("a", "merge").value(), 2);
  EXPECT_EQ(store_->Sessions().value().size(), 2U);
  ASSERT_TRUE(store_->Drop("a").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Read("a", 0, 1).status()));
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  EXPECT_TRUE(store_->Snapshots("a").value().empty());
  EXPECT_EQ(store_->BeginWork("a", "merge").value(), 1);
}

// All or nothing.
TEST_P(StoreTest, OnlyWholeEntriesAreLeftOutAndNeverTheLast) {
  for (uint64_t i = 1; i <= 6; ++i) ASSERT_TRUE(store_->Append("a", NumberedEntry(i)).ok());
  ASSERT_TRUE(store_->Compact("a", {StandsFor(2, 4)}).ok());
  for (const auto& wrong : {StandsFor(3, 4), StandsFor(2, 3), StandsFor(3, 5), StandsFor(5, 6),
                            StandsFor(6, 7), StandsFor(5, 4), StandsFor(1, 2)}) {
    EXPECT_TRUE(absl::IsAborted(store_->Compact("a", {StandsFor(2, 5), wrong})))
        << wrong.DebugString();
  }
  EXPECT_TRUE(absl::IsAborted(store_->Compact("none", {StandsFor(2, 4)})));
  using Span = std::pair<uint64_t, uint64_t>;
  EXPECT_THAT(Spans(*store_, 0), ElementsAre(Span(1, 1), Span(2, 4), Span(5, 5), Span(6, 6)));
}

std::string Piece(absl::string_view bytes, bool compressed) {
  storage::v1::SpoolRecord record;
  storage::v1::SpoolRecord::Piece& piece = *record.mutable_piece();
  piece.set_crc32c(bytes::Crc32c(bytes));
  piece.set_data(compressed ? bytes::ZstdCompress(bytes) : std::string(bytes));
  if (compressed) {
    piece.set_compression(v1::COMPRESSION_ZSTD);
    piece.set_uncompressed_size_bytes(static_cast<int64_t>(bytes.size()));
  }
  return record.SerializeAsString();
}

TEST_P(StoreTest, BegunWorkIsCountedUntilItEnds) {
  EXPECT_TRUE(absl::IsNotFound(store_->BeginWork("a", "merge").status()));
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  EXPECT_EQ(store_->BeginWork("a", "merge").value(), 1);
  EXPECT_EQ(store_->BeginWork("a", "merge").value(), 2);
  EXPECT_EQ(store_->BeginWork("a", "load").value(), 1);
  EXPECT_TRUE(store_->EndWork("a", "merge").ok());
  EXPECT_TRUE(store_->EndWork("a", "merge").ok());
  EXPECT_TRUE(store_->EndWork("b", "merge").ok());
  EXPECT_EQ(store_->BeginWork("a", "merge").value(), 1);
  ASSERT_TRUE(store_->Drop("a").ok());
  ASSERT_TRUE(store_->Append("a", NumberedEntry(1)).ok());
  EXPECT_EQ(store_->BeginWork("a", "load").value(), 1);
}

TEST_P(StoreTest, ASpoolIsKeptAsTheBlobItComesTo) {
  const std::string spool = "sessions/a/uploads/upload-1";
  const std::string first(5000, 'a');
  const std::string second = "and as it is";
  ASSERT_TRUE(store_->AppendSpool(spool, Piece(first, true)).ok());
  storage::v1::SpoolRecord total;
  total.mutable_total()->set_encoded_size_bytes(5012);
  ASSERT_TRUE(store_->AppendSpool(spool, total.SerializeAsString()).ok());
  ASSERT_TRUE(store_->AppendSpool(spool, Piece(second, false)).ok());
  ASSERT_TRUE(store_->SyncSpool(spool).ok());
  const std::string sha = bytes::Sha256::Of(first + second);
  ASSERT_TRUE(store_->PutSpool(spool, sha).ok());
  // Not committed after all, and once more.
  EXPECT_TRUE(store_->ReleaseBlob(sha).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(sha).status()));
  EXPECT_EQ(Records(*store_, spool).size(), 3U);
  ASSERT_TRUE(store_->PutSpool(spool, sha).ok());
  ASSERT_TRUE(store_->DropSpool(spool).ok());
  EXPECT_EQ(store_->GetBlob(sha).value(), first + second);
  EXPECT_GT(store_->BlobSize(sha).value(), 0);
  // The same bytes by another way are the same blob.
  EXPECT_EQ(store_->PutBlob(first + second).value(), sha);
  EXPECT_TRUE(store_->ReleaseBlob(sha).ok());
  EXPECT_EQ(store_->GetBlob(sha).value(), first + second);
  EXPECT_TRUE(store_->KeepBlobs({{sha, 1}}).ok());
  EXPECT_EQ(store_->GetBlob(sha).value(), first + second);
  EXPECT_TRUE(store_->KeepBlobs({}).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(sha).status()));
}

TEST_P(StoreTest, ASpoolIsReadAsTheFileItComesTo) {
  EXPECT_EQ(store_->OpenSpool("sessions/a/uploads/upload-1").status().code(),
            absl::StatusCode::kNotFound);
  const std::string bytes(3000, 'x');
  storage::v1::SpoolRecord record;
  record.mutable_piece()->set_data("first ");
  ASSERT_TRUE(store_->AppendSpool("sessions/a/uploads/upload-1", record.SerializeAsString()).ok());
  record.mutable_piece()->set_data(bytes::ZstdCompress(bytes));
  record.mutable_piece()->set_compression(v1::COMPRESSION_ZSTD);
  record.mutable_piece()->set_uncompressed_size_bytes(3000);
  ASSERT_TRUE(store_->AppendSpool("sessions/a/uploads/upload-1", record.SerializeAsString()).ok());
  const int64_t free = store_->FreeBytes().value();
  EXPECT_GT(free, 0);
  const auto file = store_->OpenSpool("sessions/a/uploads/upload-1");
  ASSERT_TRUE(file.ok()) << file.status();
  std::string read(4000, '\0');
  const ssize_t got = pread(file->get(), read.data(), read.size(), 0);
  ASSERT_EQ(got, 3006);
  EXPECT_EQ(read.substr(0, 3006), "first " + bytes);
  // For reading only, and no spool of its own.
  EXPECT_LT(write(file->get(), "x", 1), 0);
  EXPECT_THAT(*store_->Spools(), ElementsAre("sessions/a/uploads/upload-1"));
}

TEST_P(StoreTest, BlobsAreCounted) {
  const std::string bytes(600, 'x');
  const std::string sha = store_->PutBlob(bytes).value();
  EXPECT_EQ(sha, bytes::Sha256::Of(bytes));
  EXPECT_EQ(store_->PutBlob(bytes).value(), sha);
  EXPECT_EQ(store_->BlobSize(sha).value(), 600);
  EXPECT_TRUE(store_->ReleaseBlob(sha).ok());
  EXPECT_EQ(store_->GetBlob(sha).value(), bytes);
  EXPECT_TRUE(store_->ReleaseBlob(sha).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(sha).status()));
  EXPECT_TRUE(absl::IsNotFound(store_->BlobSize(sha).status()));
  EXPECT_TRUE(absl::IsNotFound(store_->ReleaseBlob(sha)));
  EXPECT_EQ(store_->PutBlob(bytes).value(), sha);
  EXPECT_EQ(store_->GetBlob(sha).value(), bytes);
}

TEST_P(StoreTest, BlobsThatNobodyHoldsGo) {
  const std::string kept = store_->PutBlob("kept").value();
  const std::string gone = store_->PutBlob("gone").value();
  ASSERT_TRUE(store_->KeepBlobs({{kept, 2}, {bytes::Sha256::Of("never there"), 1}}).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(gone).status()));
  EXPECT_TRUE(store_->ReleaseBlob(kept).ok());
  EXPECT_EQ(store_->GetBlob(kept).value(), "kept");
  EXPECT_TRUE(store_->ReleaseBlob(kept).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->GetBlob(kept).status()));
}

TEST_P(StoreTest, SpoolsKeepRecordsInOrder) {
  const std::string name = "sessions/a/uploads/upload-1";
  EXPECT_TRUE(Records(*store_, name).empty());
  const std::vector<std::string> records = {"hello", "", std::string(70'000, '\0'), "you"};
  for (const std::string& record : records) ASSERT_TRUE(store_->AppendSpool(name, record).ok());
  ASSERT_TRUE(store_->AppendSpool("sessions/a/uploads/upload-2", "other").ok());
  EXPECT_EQ(Records(*store_, name), records);
  EXPECT_EQ(store_->Spools().value(),
            (std::vector<std::string>{name, "sessions/a/uploads/upload-2"}));
  const absl::Status stopped =
      store_->ReadSpool(name, [](absl::string_view) { return absl::CancelledError("enough"); });
  EXPECT_TRUE(absl::IsCancelled(stopped));
  EXPECT_TRUE(store_->SyncSpool(name).ok());
  EXPECT_TRUE(store_->CutSpool(name, records.size()).ok());
  EXPECT_EQ(Records(*store_, name), records);
  EXPECT_TRUE(store_->CutSpool(name, 1).ok());
  ASSERT_TRUE(store_->AppendSpool(name, "instead").ok());
  EXPECT_EQ(Records(*store_, name), (std::vector<std::string>{records[0], "instead"}));
  EXPECT_TRUE(store_->DropSpool(name).ok());
  EXPECT_TRUE(store_->DropSpool(name).ok());
  EXPECT_TRUE(Records(*store_, name).empty());
}

INSTANTIATE_TEST_SUITE_P(Stores, StoreTest, testing::Values("memory", "disk"),
                         [](const auto& chosen) { return std::string(chosen.param); });

TEST(MemoryStore, RoomIsBoundedAndComesBack) {
  MemoryStore store(1000);
  const std::string sha = store.PutBlob(std::string(600, 'x')).value();
  EXPECT_EQ(store.PutBlob(std::string(600, 'x')).value(), sha);  // the same takes no more room
  EXPECT_TRUE(absl::IsResourceExhausted(store.PutBlob(std::string(500, 'y')).status()));
  EXPECT_TRUE(absl::IsResourceExhausted(store.AppendSpool("s", std::string(401, 'z'))));
  EXPECT_TRUE(store.AppendSpool("s", std::string(400, 'z')).ok());
  EXPECT_TRUE(store.DropSpool("s").ok());
  EXPECT_TRUE(store.KeepBlobs({}).ok());
  EXPECT_EQ(store.used(), 0U);
}

}  // namespace
}  // namespace vantage::store
