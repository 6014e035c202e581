// Data folders of earlier servers: their logs must give the same state as they did then.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "google/protobuf/message.h"
#include "google/protobuf/util/field_mask_util.h"
#include "server/store/disk_store.h"
#include "server/store/upgrade.h"
#include "tests/server/fixture/session_host.h"
#include "tests/server/session/describe_state.h"
#include "tests/server/session/every_event_job.h"
#include "tests/support/golden.h"

namespace vantage::session {
namespace {

constexpr int kEventKinds = 19;

class RecordedLog : public testing::Test {
 protected:
  RecordedLog() {
    std::string name = absl::StrCat(testing::TempDir(), "/recorded-XXXXXX");
    folder_ = mkdtemp(name.data());
  }
  ~RecordedLog() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }

  static std::string Recorded(const std::string& name) {
    return absl::StrCat(TEST_DATA_FOLDER, "/", name);
  }
  // On a copy: a server writes to its folder.
  void Open(const std::string& name) {
    std::filesystem::copy(Recorded(name), folder_,
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
    store_ = store::DiskStore::Open(folder_).value();
  }
  SessionState Fold(const std::string& session) {
    SessionState state;
    const std::vector<storage::v1::LogEntry> log = store_->Read(session, 0, 10'000).value();
    for (const storage::v1::LogEntry& entry : log) {
      const absl::Status applied = state.Apply(entry);
      EXPECT_TRUE(applied.ok()) << applied;
    }
    return state;
  }
  test_support::GoldenText FoldAll() {
    test_support::GoldenText out;
    const std::vector<std::string> sessions = store_->Sessions().value();
    for (const std::string& session : sessions) {
      out.Section(session);
      Describe(Fold(session), *store_, out);
    }
    DescribeSpools(*store_, out);
    return out;
  }

  std::string folder_;
  std::unique_ptr<store::DiskStore> store_;
};

TEST_F(RecordedLog, OfTheFirstReleaseFoldsToTheSameState) {
  Open("release_0_1");
  test_support::ExpectGolden(FoldAll(), Recorded("release_0_1.txt"));
}

TEST_F(RecordedLog, WithEveryEventFoldsToTheSameState) {
  Open("every_event");
  test_support::ExpectGolden(FoldAll(), Recorded("every_event.txt"));
}

// Whether a message, or one that it holds, has fields that this server does not know.
bool HasUnknownFields(const google::protobuf::Message& message) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (!reflection.GetUnknownFields(message).empty()) return true;
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const google::protobuf::FieldDescriptor* field : fields) {
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      if (HasUnknownFields(reflection.GetMessage(message, field))) return true;
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      if (HasUnknownFields(reflection.GetRepeatedMessage(message, field, i))) return true;
    }
  }
  return false;
}

TEST_F(RecordedLog, IsUnderstoodWhole) {
  for (const char* folder : {"release_0_1", "every_event"}) {
    Open(folder);
    int results = 0;
    const std::vector<std::string> sessions = store_->Sessions().value();
    for (const std::string& session : sessions) {
      const std::vector<storage::v1::LogEntry> log = store_->Read(session, 0, 10'000).value();
      for (const storage::v1::LogEntry& entry : log) {
        const std::string where = absl::StrCat(folder, " ", session, " ", entry.event().sequence());
        EXPECT_EQ(entry.format_version(), store::kLogFormatVersion) << where;
        EXPECT_FALSE(HasUnknownFields(entry)) << where;
        for (const std::string& path : entry.event().session_updated().update_mask().paths()) {
          EXPECT_TRUE(google::protobuf::util::FieldMaskUtil::IsValidPath<v1::Session>(path))
              << where << ": " << path;
        }
        if (!entry.event().has_plan_ended() || entry.blob().empty()) continue;
        v1::PlanResult result;
        ASSERT_TRUE(result.ParseFromString(store_->GetBlob(entry.blob()).value())) << where;
        EXPECT_TRUE(HasUnknownFields(result)) << where;  // of the old numbers
        store::Upgrade(result);
        EXPECT_FALSE(HasUnknownFields(result)) << where;
        ++results;
      }
    }
    EXPECT_GT(results, 0) << folder;
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
}

TEST_F(RecordedLog, HasEveryEvent) {
  Open("every_event");
  std::array<int, kEventKinds> count{};
  const std::vector<storage::v1::LogEntry> log = store_->Read("job", 0, 10'000).value();
  for (const storage::v1::LogEntry& entry : log) {
    // The first field of the kinds of events is number 3.
    ++count.at(static_cast<size_t>(entry.event().event_case()) - 3);
  }
  for (int kind = 0; kind < kEventKinds; ++kind) EXPECT_GT(count[kind], 0) << "field " << kind + 3;
}

// A server loads it, builds its model, and goes on with the upload that was under way.
TEST_F(RecordedLog, WithEveryEventIsLoaded) {
  Open("every_event");
  fixture::SessionHost host(*store_, Algorithms::Core(), {}, EveryEventJobEnd);
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const auto session = host.registry.Find("job", "office").value();
  session->WaitUntilIdle();
  test_support::GoldenText out;
  const v1::Session described = session->DescribeWithRejections();
  const v1::ScanCounts& scans = described.scan_counts();
  out.Counts("scans: pending, merged, doubtful, failed, withdrawn",
             {scans.unmerged_count(), scans.merged_count(), scans.doubtful_count(),
              scans.failed_count(), scans.withdrawn_count()});
  out.Counts("events, rejections",
             {static_cast<int64_t>(described.last_sequence()), described.rejections_size()});
  bool more = false;
  const std::vector<v1::Claim> claims = session->claims().List("", 100, more).value();
  for (const v1::Claim& claim : claims) out.Word("claim", claim.name());
  const v1::Upload left = session->uploads().Get("sessions/job/uploads/upload-8").value();
  out.Counts(
      "upload: state, pieces, bytes, of",
      {left.state(), left.next_sequence(), left.next_offset(), left.total().encoded_size_bytes()});
  const ModelSnapshot model = session->model().Current();
  ASSERT_NE(model.view, nullptr);
  test_support::GoldenText bricks;
  for (const model::BrickAt& at : model.view->bricks()) {
    std::string states;
    for (const model::VoxelState state : at.contents->state) {
      states += static_cast<char>('0' + static_cast<int>(state));
    }
    bricks.Counts("brick", {at.brick.x(), at.brick.y(), at.brick.z()});
    bricks.Word("states", states);
    for (const model::SurfaceVoxel& voxel : at.contents->surface) {
      bricks.Numbers("centroid", voxel.centroid.cast<double>());
      bricks.Numbers("normal", voxel.normal.cast<double>());
      bricks.Numbers("area, density", {voxel.area, voxel.density});
    }
  }
  out.Counts("model: stations, surface voxels",
             {static_cast<int64_t>(model.view->stations().size()),
              static_cast<int64_t>(model.view->SurfaceCount())});
  out.Lines("model", bricks);
  test_support::ExpectGolden(out, Recorded("every_event_loaded.txt"));
}

// How data/every_event was made: with VANTAGE_RECORD_FOLDER, an empty folder, in the environment.
// What was recorded once stays: later servers must read what earlier ones wrote.
TEST(RecordLog, DISABLED_OfAJobInWhichEverythingHappens) {
  const char* folder = std::getenv("VANTAGE_RECORD_FOLDER");
  ASSERT_NE(folder, nullptr);
  {
    const auto store = store::DiskStore::Open(folder).value();
    RunEveryEventJob(*store);
  }
  std::filesystem::remove(std::filesystem::path(folder) / "lock");
}

}  // namespace
}  // namespace vantage::session
