// A power cut at any write, sync or rename loses nothing that was acknowledged, and the job ends as
// it would have without. ./dev faults tries all points.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "server/store/disk_store.h"
#include "server/store/durable_file.h"
#include "tests/faults/crash_points.h"
#include "tests/faults/crashed_disk.h"
#include "tests/faults/disk_recorder.h"

namespace vantage::faults {
namespace {

class Scratch {
 public:
  Scratch() {
    std::string name = testing::TempDir() + "/faults-XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~Scratch() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(CrashPoints, NothingIsLostAndTheJobEndsAsItWould) {
  constexpr uint64_t kSeed = 11;
  constexpr size_t kStride = 23;  // prime to the periods of what a job repeats
  const Scratch scratch;
  const auto points =
      CrashAtEveryPoint(scratch.path(), kSeed % kStride, kStride, kSeed, [] { return true; });
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_GT(points->steps, 200u);
  EXPECT_GT(points->crashes_twice, 5u);
  for (const std::string& fault : points->faults)
    ADD_FAILURE() << "seed " << kSeed << ", " << fault;
  RecordProperty("crashes", static_cast<int>(points->crashes));
}

// No room, I/O errors, a read-only disk: clear errors, nothing that was acknowledged is lost, and
// the service goes on when the disk is well again.
TEST(DiskFaults, TheServiceGoesOnWhenTheDiskDoes) {
  const Scratch scratch;
  const auto done = FailAtPoints(scratch.path(), 5, 61, [] { return true; });
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_GT(done->refusals, 2u);
  for (const std::string& fault : done->faults) ADD_FAILURE() << fault;
}

storage::v1::LogEntry EntryOf(uint64_t first, uint64_t last) {
  storage::v1::LogEntry entry;
  entry.set_format_version(store::kLogFormatVersion);
  entry.mutable_event()->set_sequence(last);
  if (first != last) {
    entry.mutable_event()->mutable_events_left_out()->set_first_sequence(first);
  } else {
    // Several entries to a page of the database.
    entry.mutable_event()->mutable_upload_ended()->mutable_upload()->set_state_message(
        std::string(700, 'u'));
  }
  return entry;
}

std::vector<std::string> LogIn(const std::string& folder) {
  std::vector<std::string> log;
  const auto store = store::DiskStore::Open(folder);
  EXPECT_TRUE(store.ok()) << store.status();
  if (!store.ok()) return log;
  const auto entries = (*store)->Read("job", 0, 1000);
  EXPECT_TRUE(entries.ok()) << entries.status();
  if (!entries.ok()) return log;
  for (const storage::v1::LogEntry& entry : *entries) log.push_back(entry.SerializeAsString());
  return log;
}

// At any step of compacting a log, it is as before or as after.
TEST(CrashPoints, ACompactedLogIsTheOneOrTheOther) {
  const Scratch scratch;
  const std::string base = scratch.path() + "/base";
  const std::string live = scratch.path() + "/live";
  const std::string crashed = scratch.path() + "/crashed";
  std::filesystem::create_directory(base);
  {
    const auto store = store::DiskStore::Open(base).value();
    for (uint64_t i = 1; i <= 60; ++i) ASSERT_TRUE(store->Append("job", EntryOf(i, i)).ok());
  }
  const std::vector<std::string> before = LogIn(base);
  ASSERT_EQ(before.size(), 60U);
  std::filesystem::copy(base, live, std::filesystem::copy_options::recursive);
  DiskRecorder::Start(live);
  size_t compacted = 0;
  {
    const auto store = store::DiskStore::Open(live).value();
    ASSERT_TRUE(store->Compact("job", {EntryOf(2, 30), EntryOf(33, 50)}).ok());
    compacted = DiskRecorder::Count();
  }
  const std::vector<DiskStep> steps = DiskRecorder::Stop();
  const std::vector<std::string> after = LogIn(live);
  ASSERT_EQ(after.size(), 60U - 28 - 17);
  size_t old = 0;
  for (size_t count = 0; count <= steps.size(); ++count) {
    for (const Unsynced unsynced : {Unsynced::kLost, Unsynced::kKept, Unsynced::kTorn}) {
      MakeCrashedFolder(base, std::span<const DiskStep>(steps).first(count), unsynced, count,
                        crashed);
      const std::vector<std::string> found = LogIn(crashed);
      old += found == before ? 1 : 0;
      EXPECT_TRUE(found == after || (found == before && count < compacted))
          << "after step " << count << " of " << steps.size();
      std::filesystem::remove_all(crashed);
    }
  }
  EXPECT_GT(old, 3U);
}

std::string Contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The harness detects the faults that it is made for.
TEST(CrashedDisk, ForgetsWhatWasNotSynced) {
  const Scratch scratch;
  const std::string live = scratch.path() + "/live";
  const std::string data = live + "/data";
  std::filesystem::create_directory(live);
  DiskRecorder::Start(live);
  ASSERT_TRUE(store::MakeFolder(data).ok());
  const std::string synced = data + "/synced";
  ASSERT_TRUE(store::ReplaceFile(synced, data + "/temporary", "first").ok());
  {
    const store::FileDescriptor file(::open(synced.c_str(), O_RDWR | O_CLOEXEC));
    ASSERT_TRUE(store::WriteAt(file.get(), "12345", 5, synced).ok());
    ASSERT_TRUE(store::SyncData(file.get(), synced).ok());
    ASSERT_TRUE(store::WriteAt(file.get(), "FIRST", 0, synced).ok());
    const std::string nameless = data + "/nameless";
    const store::FileDescriptor other(::open(nameless.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    ASSERT_TRUE(store::WriteAt(other.get(), "x", 0, nameless).ok());
    ASSERT_TRUE(store::SyncData(other.get(), nameless).ok());
  }
  const std::vector<DiskStep> steps = DiskRecorder::Stop();
  MakeCrashedFolder("", steps, Unsynced::kLost, 1, scratch.path() + "/lost");
  EXPECT_EQ(Contents(scratch.path() + "/lost/data/synced"), "first12345");
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/lost/data/nameless"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/lost/data/temporary"));
  MakeCrashedFolder("", steps, Unsynced::kKept, 1, scratch.path() + "/kept");
  EXPECT_EQ(Contents(scratch.path() + "/kept/data/synced"), "FIRST12345");
  EXPECT_EQ(Contents(scratch.path() + "/kept/data/nameless"), "x");
  std::set<std::string> seen;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const std::string torn = scratch.path() + "/torn" + std::to_string(seed);
    MakeCrashedFolder("", steps, Unsynced::kTorn, seed, torn);
    seen.insert(Contents(torn + "/data/synced"));
  }
  EXPECT_TRUE(seen.contains("first12345"));
  EXPECT_TRUE(seen.contains("FIRST12345"));
  EXPECT_TRUE(seen.contains("FIrst12345"));
}

}  // namespace
}  // namespace vantage::faults
