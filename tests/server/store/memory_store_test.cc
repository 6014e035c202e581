#include "server/store/memory_store.h"

#include <gtest/gtest.h>

#include <string>

#include "proto/wire/checksum.h"

namespace vantage {
namespace {

store::v1::LogEntry Entry(uint64_t sequence) {
  store::v1::LogEntry entry;
  entry.set_format_version(kLogFormatVersion);
  entry.mutable_event()->set_sequence(sequence);
  return entry;
}

TEST(MemoryStore, LogsAreOrderedAndFenced) {
  MemoryStore store(1 << 20);
  EXPECT_TRUE(store.Append("a", Entry(1)).ok());
  EXPECT_TRUE(store.Append("a", Entry(2)).ok());
  EXPECT_TRUE(absl::IsAborted(store.Append("a", Entry(2))));
  EXPECT_TRUE(absl::IsAborted(store.Append("a", Entry(4))));
  EXPECT_TRUE(absl::IsAborted(store.Append("b", Entry(2))));
  const auto all = store.Read("a", 0, 10).value();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1].event().sequence(), 2U);
  EXPECT_EQ(store.Read("a", 1, 10).value().size(), 1U);
  EXPECT_EQ(store.Read("a", 0, 1).value().size(), 1U);
  EXPECT_TRUE(store.Read("a", 99, 10).value().empty());
  EXPECT_TRUE(absl::IsNotFound(store.Read("c", 0, 1).status()));
  EXPECT_EQ(store.Sessions().value(), std::vector<std::string>{"a"});
}

TEST(MemoryStore, BlobsAreCountedAndRoomComesBack) {
  MemoryStore store(1000);
  const std::string bytes(600, 'x');
  const std::string sha = store.PutBlob(bytes).value();
  EXPECT_EQ(sha, Sha256::Of(bytes));
  EXPECT_EQ(store.PutBlob(bytes).value(), sha);  // the same bytes take no more room
  EXPECT_TRUE(absl::IsResourceExhausted(store.PutBlob(std::string(500, 'y')).status()));
  EXPECT_TRUE(store.ReleaseBlob(sha).ok());
  EXPECT_EQ(store.GetBlob(sha).value(), bytes);
  EXPECT_TRUE(store.ReleaseBlob(sha).ok());
  EXPECT_TRUE(absl::IsNotFound(store.GetBlob(sha).status()));
  EXPECT_EQ(store.used(), 0U);
  EXPECT_TRUE(store.PutBlob(std::string(500, 'y')).ok());
}

TEST(MemoryStore, SpoolsAppendUntilFull) {
  MemoryStore store(10);
  EXPECT_EQ(store.ReadSpool("s").value(), "");
  EXPECT_TRUE(store.AppendSpool("s", "hello").ok());
  EXPECT_TRUE(store.AppendSpool("s", " you").ok());
  EXPECT_TRUE(absl::IsResourceExhausted(store.AppendSpool("s", "more")));
  EXPECT_EQ(store.ReadSpool("s").value(), "hello you");
  EXPECT_TRUE(store.DropSpool("s").ok());
  EXPECT_EQ(store.used(), 0U);
}

}  // namespace
}  // namespace vantage
