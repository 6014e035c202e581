// Previews, and the whole scans that come in their places.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/sensor/encoding.h"
#include "core/sensor/thinning.h"
#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

const Eigen::Vector3d kFirstPlace(2.0, 1.5, 1.4);
const Eigen::Vector3d kSecondPlace(3.0, 2.5, 1.4);

std::string Whole(const Eigen::Vector3d& position) { return fixture::EncodedRoom(position, 2.0); }

std::string Preview(const Eigen::Vector3d& position) {
  return sensor::EncodeRangeImage(
      sensor::Thinned(fixture::ScanRoom(position, 2.0), sensor::Radians(6)));
}

v1::Upload Described(const Eigen::Vector3d& position, bool preview,
                     const std::string& replaces = "") {
  v1::Upload upload;
  *upload.mutable_prior() = fixture::PriorAt(position.x(), position.y(), position.z());
  upload.set_preview(preview);
  upload.set_replaces(replaces);
  return upload;
}

class PreviewsTest : public testing::Test {
 protected:
  PreviewsTest() {
    script_.EndPlans();
    Start();
    session_ = fixture::OpenSession(host_->registry, "job");
  }

  void Start() { host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make()); }
  void Restart() {
    session_.reset();
    host_.reset();
    Start();
    session_ = fixture::LoadSession(host_->registry, "job");
  }
  v1::Scan Send(const std::string& bytes, const v1::Upload& described) {
    const auto upload = fixture::SendDescribed(*session_, bytes, described);
    EXPECT_TRUE(upload.ok()) << upload.status();
    if (!upload.ok()) return {};
    session_->WaitUntilIdle();
    return session_->scans().Get(upload->scan()).value();
  }
  // The scan's name.
  std::string SendPreview(const Eigen::Vector3d& position) {
    const v1::Scan scan = Send(Preview(position), Described(position, true));
    EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED);
    EXPECT_TRUE(scan.preview());
    return scan.name();
  }
  absl::Status Refused(const std::string& replaces) {
    return fixture::SendDescribed(*session_, Whole(kFirstPlace),
                                  Described(kFirstPlace, false, replaces))
        .status();
  }
  bool Stored(const std::string& sha256) { return store_.GetBlob(sha256).ok(); }
  std::shared_ptr<const model::PlanningView> View() { return session_->model().Current().view; }

  store::MemoryStore store_{64 << 20};
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

size_t Surface(const model::PlanningView& view) {
  size_t count = 0;
  for (const model::BrickAt& brick : view.bricks()) count += brick.contents->surface.size();
  return count;
}

// As in a job to which nothing but whole scans came.
void ExpectAsFromWholeScans(const model::PlanningView& view) {
  store::MemoryStore store(64 << 20);
  fixture::Script script;
  fixture::SessionHost host(store, script.Make());
  const auto session = fixture::OpenSession(host.registry, "other");
  for (const Eigen::Vector3d& position : {kFirstPlace, kSecondPlace}) {
    ASSERT_TRUE(fixture::SendDescribed(*session, Whole(position), Described(position, false)).ok());
    session->WaitUntilIdle();
  }
  const auto expected = session->model().Current().view;
  EXPECT_EQ(Surface(view), Surface(*expected));
  ASSERT_EQ(view.stations().size(), expected->stations().size());
  for (size_t i = 0; i < view.stations().size(); ++i) {
    EXPECT_EQ(view.stations()[i].position, expected->stations()[i].position);
  }
}

TEST_F(PreviewsTest, TheWholeScanComesUnderTheSameNameAndNothingElseChanges) {
  const std::string name = SendPreview(kFirstPlace);
  SendPreview(kSecondPlace);
  const v1::Scan before = session_->scans().Get(name).value();
  const v1::Scan whole = Send(Whole(kFirstPlace), Described(kFirstPlace, false, name));
  EXPECT_EQ(whole.name(), name);
  EXPECT_EQ(whole.state(), v1::SCAN_STATE_MERGED);
  EXPECT_FALSE(whole.preview());
  EXPECT_TRUE(whole.has_replace_time());
  EXPECT_GT(whole.sample_count(), 5 * before.sample_count());
  EXPECT_EQ(whole.pose().SerializeAsString(), before.pose().SerializeAsString());
  EXPECT_EQ(whole.pose_source(), before.pose_source());
  EXPECT_EQ(whole.merge().obtained_gain_m2(), before.merge().obtained_gain_m2());
  EXPECT_EQ(whole.create_time().seconds(), before.create_time().seconds());
  EXPECT_FALSE(Stored(before.sha256()));
  EXPECT_TRUE(Stored(whole.sha256()));
  // One version more: it was never without the scan.
  EXPECT_EQ(session_->model().Current().version, 3U);
  const v1::Scan second =
      Send(Whole(kSecondPlace), Described(kSecondPlace, false, "sessions/job/scans/scan-2"));
  EXPECT_EQ(second.name(), "sessions/job/scans/scan-2");
  ExpectAsFromWholeScans(*View());
  const size_t surface = Surface(*View());
  Restart();
  ASSERT_NE(View(), nullptr);
  EXPECT_EQ(Surface(*View()), surface);
  ExpectAsFromWholeScans(*View());
}

TEST_F(PreviewsTest, ABetterPreviewMayComeFirst) {
  const std::string name = SendPreview(kFirstPlace);
  const v1::Scan better = Send(Whole(kFirstPlace), Described(kFirstPlace, true, name));
  EXPECT_TRUE(better.preview());
  const v1::Scan whole =
      Send(fixture::EncodedRoom(kFirstPlace, 1.0), Described(kFirstPlace, false, name));
  EXPECT_FALSE(whole.preview());
  EXPECT_EQ(whole.state(), v1::SCAN_STATE_MERGED);
  EXPECT_FALSE(Stored(better.sha256()));
}

TEST_F(PreviewsTest, AnotherScanIsDroppedAndThePreviewStays) {
  const std::string name = SendPreview(kFirstPlace);
  SendPreview(kSecondPlace);
  const v1::Scan before = session_->scans().Get(name).value();
  const size_t surface = Surface(*View());
  const v1::Scan after = Send(Whole(kSecondPlace), Described(kFirstPlace, false, name));
  EXPECT_EQ(after.state(), v1::SCAN_STATE_MERGED);
  EXPECT_TRUE(after.preview());
  EXPECT_FALSE(after.has_replace_time());
  EXPECT_NE(after.state_message().find("another scan"), std::string::npos) << after.state_message();
  EXPECT_EQ(after.sha256(), before.sha256());
  EXPECT_TRUE(Stored(before.sha256()));
  EXPECT_EQ(Surface(*View()), surface);
  Restart();
  EXPECT_EQ(Surface(*View()), surface);
  // And its own scan still takes its place.
  const v1::Scan whole = Send(Whole(kFirstPlace), Described(kFirstPlace, false, name));
  EXPECT_FALSE(whole.preview());
  EXPECT_EQ(whole.state_message(), "");
}

TEST_F(PreviewsTest, OneThatDidNotRegisterIsAlignedAnew) {
  SendPreview(kFirstPlace);
  script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
  const v1::Scan doubtful = Send(Preview(kSecondPlace), Described(kSecondPlace, true));
  ASSERT_EQ(doubtful.state(), v1::SCAN_STATE_DOUBTFUL);
  script_.SetVerdict(registration::RegistrationOutcome::kRegistered);
  const v1::Scan whole = Send(Whole(kSecondPlace), Described(kSecondPlace, false, doubtful.name()));
  EXPECT_EQ(whole.name(), doubtful.name());
  EXPECT_EQ(whole.state(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(whole.pose_source(), v1::POSE_SOURCE_REGISTRATION);
  EXPECT_FALSE(Stored(doubtful.sha256()));
}

// The server stops while the whole scan waits: the preview is in the model again, and then gives
// way.
TEST_F(PreviewsTest, ARestartInBetweenLosesNeither) {
  const std::string name = SendPreview(kFirstPlace);
  script_.PauseAlignments();
  ASSERT_TRUE(
      fixture::SendDescribed(*session_, Preview(kSecondPlace), Described(kSecondPlace, true)).ok());
  script_.WaitForAlignment();
  const v1::Scan before = session_->scans().Get(name).value();
  ASSERT_TRUE(
      fixture::SendDescribed(*session_, Whole(kFirstPlace), Described(kFirstPlace, false, name))
          .ok());
  EXPECT_EQ(session_->scans().Get(name)->state(), v1::SCAN_STATE_MERGING);
  EXPECT_TRUE(Stored(before.sha256()));
  EXPECT_EQ(View()->stations().size(), 1U);
  script_.ReleaseAlignments();
  Restart();
  const v1::Scan whole = session_->scans().Get(name).value();
  EXPECT_EQ(whole.state(), v1::SCAN_STATE_MERGED);
  EXPECT_FALSE(whole.preview());
  EXPECT_FALSE(Stored(before.sha256()));
  Send(Whole(kSecondPlace), Described(kSecondPlace, false, "sessions/job/scans/scan-2"));
  ExpectAsFromWholeScans(*View());
}

TEST_F(PreviewsTest, AWithdrawnOneLeavesWithBoth) {
  const std::string name = SendPreview(kFirstPlace);
  const v1::Scan before = session_->scans().Get(name).value();
  Send(Whole(kFirstPlace), Described(kFirstPlace, false, name));
  ASSERT_TRUE(session_->scans().Withdraw(name, {}).ok());
  session_->WaitUntilIdle();
  EXPECT_EQ(View(), nullptr);
  EXPECT_FALSE(Stored(before.sha256()));
  EXPECT_EQ(Refused(name).code(), absl::StatusCode::kFailedPrecondition);
}

// A copy of a scan, whole or thinned, is no other look at the place.
TEST_F(PreviewsTest, TheSameSamplesAreNotMergedTwice) {
  const v1::Scan first = Send(Whole(kFirstPlace), Described(kFirstPlace, false));
  const size_t surface = Surface(*View());
  for (const std::string& bytes : {Whole(kFirstPlace), Preview(kFirstPlace)}) {
    const v1::Scan copy = Send(bytes, Described(kFirstPlace, false));
    EXPECT_EQ(copy.state(), v1::SCAN_STATE_FAILED);
    EXPECT_NE(copy.state_message().find(first.name()), std::string::npos) << copy.state_message();
    EXPECT_EQ(Surface(*View()), surface);
  }
  // As the same bytes are wherever they are said to come from.
  EXPECT_EQ(Send(Whole(kFirstPlace), Described(kSecondPlace, false)).state(),
            v1::SCAN_STATE_FAILED);
  EXPECT_EQ(Send(Whole(kSecondPlace), Described(kSecondPlace, false)).state(),
            v1::SCAN_STATE_MERGED);
  // It comes in again once the first has left.
  ASSERT_TRUE(session_->scans().Withdraw(first.name(), {}).ok());
  session_->WaitUntilIdle();
  EXPECT_EQ(Send(Whole(kFirstPlace), Described(kFirstPlace, false)).state(), v1::SCAN_STATE_MERGED);
}

TEST_F(PreviewsTest, NothingElseIsReplaced) {
  const v1::Scan whole = Send(Whole(kFirstPlace), Described(kFirstPlace, false));
  const absl::Status none = Refused(whole.name());
  EXPECT_EQ(contract::ReasonOf(none), "SCAN_STATE") << none;
  EXPECT_NE(none.message().find("no preview"), std::string::npos);
  const absl::Status unknown = Refused("sessions/job/scans/scan-9");
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(unknown.ToString().find("upload.replaces"), std::string::npos) << unknown;
}

}  // namespace
}  // namespace vantage::session
