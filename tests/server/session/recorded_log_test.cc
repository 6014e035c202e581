// Folders that servers before this one left: what their logs come to is what it always was.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/store/disk_store.h"
#include "tests/server/fixture/session_host.h"
#include "tests/server/session/describe_state.h"
#include "tests/server/session/every_event_job.h"
#include "tests/support/golden.h"

namespace vantage {
namespace {

constexpr int kEventKinds = 19;

class RecordedLog : public testing::Test {
 protected:
  RecordedLog() {
    std::string name = testing::TempDir() + "/recorded-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~RecordedLog() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }

  static std::string Recorded(const std::string& name) {
    return std::string(TEST_DATA_FOLDER) + "/" + name;
  }
  // On a copy: a server writes to its folder.
  void Open(const std::string& name) {
    std::filesystem::copy(Recorded(name), folder_,
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
    store_ = DiskStore::Open(folder_).value();
  }
  SessionState Fold(const std::string& session) {
    SessionState state;
    const std::vector<store::v1::LogEntry> log = store_->Read(session, 0, 10'000).value();
    for (const store::v1::LogEntry& entry : log) {
      const absl::Status applied = state.Apply(entry);
      EXPECT_TRUE(applied.ok()) << applied;
    }
    return state;
  }
  GoldenText FoldAll() {
    GoldenText out;
    const std::vector<std::string> sessions = store_->Sessions().value();
    for (const std::string& session : sessions) {
      out.Section(session);
      Describe(Fold(session), *store_, out);
    }
    DescribeSpools(*store_, out);
    return out;
  }

  std::string folder_;
  std::unique_ptr<DiskStore> store_;
};

TEST_F(RecordedLog, OfTheFirstReleaseFoldsToTheSameState) {
  Open("release_0_1");
  ExpectGolden(FoldAll(), Recorded("release_0_1.txt"));
}

TEST_F(RecordedLog, WithEveryEventFoldsToTheSameState) {
  Open("every_event");
  ExpectGolden(FoldAll(), Recorded("every_event.txt"));
}

TEST_F(RecordedLog, HasEveryEvent) {
  Open("every_event");
  std::array<int, kEventKinds> count{};
  const std::vector<store::v1::LogEntry> log = store_->Read("job", 0, 10'000).value();
  for (const store::v1::LogEntry& entry : log) {
    // The first field of the kinds of events is number 3.
    ++count.at(static_cast<size_t>(entry.event().event_case()) - 3);
  }
  for (int kind = 0; kind < kEventKinds; ++kind) EXPECT_GT(count[kind], 0) << "field " << kind + 3;
}

// A server takes it up, builds its model, and goes on with the upload that was under way.
TEST_F(RecordedLog, WithEveryEventIsTakenUp) {
  Open("every_event");
  SessionHost host(*store_, Algorithms::Core(), {}, EveryEventJobEnd);
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const auto session = host.registry.Find("job", "office").value();
  session->WaitUntilIdle();
  GoldenText out;
  const v1::Session described = session->Describe();
  const v1::ScanCounts& scans = described.scan_counts();
  out.Counts(
      "scans: pending, merged, doubtful, failed, withdrawn",
      {scans.pending(), scans.merged(), scans.doubtful(), scans.failed(), scans.withdrawn()});
  out.Counts("events, rejections",
             {static_cast<int64_t>(described.last_sequence()), described.rejections_size()});
  bool more = false;
  for (const v1::Claim& claim : session->ListClaims(0, 100, more)) out.Word("claim", claim.name());
  const v1::Upload left = session->GetUpload("sessions/job/uploads/upload-8").value();
  out.Counts("upload: state, pieces, bytes, of",
             {left.state(), left.next_sequence(), left.next_offset(), left.total().encoded_size()});
  const ModelSnapshot model = session->Model();
  ASSERT_NE(model.view, nullptr);
  GoldenText bricks;
  for (const BrickAt& at : model.view->bricks()) {
    std::string states;
    for (const VoxelState state : at.contents->state) {
      states += static_cast<char>('0' + static_cast<int>(state));
    }
    bricks.Counts("brick", {at.brick.x(), at.brick.y(), at.brick.z()});
    bricks.Word("states", states);
    for (const SurfaceVoxel& voxel : at.contents->surface) {
      bricks.Numbers("centroid", voxel.centroid.cast<double>());
      bricks.Numbers("normal", voxel.normal.cast<double>());
      bricks.Numbers("area, density", {voxel.area, voxel.density});
    }
  }
  out.Counts("model: stations, surface voxels", {static_cast<int64_t>(model.view->stands().size()),
                                                 static_cast<int64_t>(model.view->SurfaceCount())});
  out.Lines("model", bricks);
  ExpectGolden(out, Recorded("every_event_taken_up.txt"));
}

// How data/every_event was made: with VANTAGE_RECORD_FOLDER, an empty folder, in the environment.
// What was recorded once stays: later servers must read what earlier ones wrote.
TEST(RecordLog, DISABLED_OfAJobInWhichEverythingHappens) {
  const char* folder = std::getenv("VANTAGE_RECORD_FOLDER");
  ASSERT_NE(folder, nullptr);
  {
    const auto store = DiskStore::Open(folder).value();
    RunEveryEventJob(*store);
  }
  std::filesystem::remove(std::filesystem::path(folder) / "lock");
}

}  // namespace
}  // namespace vantage
