// What becomes of a scan whose data cannot be had when it is to be merged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::HasSubstr;

// Its blobs are read as `reading` says.
class UnreadableStore final : public store::MemoryStore {
 public:
  UnreadableStore() : MemoryStore(64 << 20) {}
  absl::StatusOr<std::string> GetBlob(const std::string& sha256) const override {
    switch (reading.load()) {
      case absl::StatusCode::kUnavailable:
        return absl::UnavailableError("cannot read the blob: Input/output error");
      case absl::StatusCode::kNotFound:
        return absl::NotFoundError("no such blob");
      default:
        return MemoryStore::GetBlob(sha256);
    }
  }
  std::atomic<absl::StatusCode> reading{absl::StatusCode::kOk};
};

class ScanReconcilerTest : public testing::Test {
 protected:
  // Of a second scan, and what it is when nothing is under way.
  v1::Scan SendUnreadable(absl::StatusCode reading) {
    EXPECT_TRUE(fixture::SendScan(*session_, fixture::EncodedRoom({2.0, 1.5, 1.4}), &first_).ok());
    session_->WaitUntilIdle();
    store_.reading = reading;
    const std::string scan =
        fixture::SendScan(*session_, fixture::EncodedRoom({3.0, 2.5, 1.4}), &second_)
            .value()
            .scan();
    session_->WaitUntilIdle();
    return session_->scans().Get(scan).value();
  }

  UnreadableStore store_;
  fixture::Script script_;
  fixture::SessionHost host_{store_, script_.Make()};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
  const v1::PosePrior first_ = fixture::PriorAt(2.0, 1.5, 1.4);
  const v1::PosePrior second_ = fixture::PriorAt(3.0, 2.5, 1.4);
};

// The medium may come back, and with it an intact scan.
TEST_F(ScanReconcilerTest, AScanThatCannotBeReadNowIsTriedAgain) {
  const v1::Scan waits = SendUnreadable(absl::StatusCode::kUnavailable);
  EXPECT_EQ(waits.state(), v1::SCAN_STATE_RECEIVED);
  EXPECT_THAT(waits.state_message(), HasSubstr("waits, and is tried again: cannot read the blob"));
  EXPECT_EQ(session_->scans().Pending(), 1);
  store_.reading = absl::StatusCode::kOk;
  while (session_->scans().Pending() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const v1::Scan merged = session_->scans().Get(waits.name()).value();
  EXPECT_EQ(merged.state(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(merged.state_message(), "");
}

// The same with the log's word that it is placed: it was accepted, and only the merge is left.
TEST_F(ScanReconcilerTest, APlacedScanThatCannotBeReadNowIsTriedAgain) {
  script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
  const std::string doubtful = SendUnreadable(absl::StatusCode::kOk).name();
  ASSERT_EQ(session_->scans().Get(doubtful)->state(), v1::SCAN_STATE_DOUBTFUL);
  store_.reading = absl::StatusCode::kUnavailable;
  ASSERT_TRUE(session_->scans().Accept(doubtful, {}).ok());
  session_->WaitUntilIdle();
  EXPECT_EQ(session_->scans().Get(doubtful)->state(), v1::SCAN_STATE_MERGING);
  EXPECT_THAT(session_->scans().Get(doubtful)->state_message(), HasSubstr("is tried again"));
}

// What is gone does not come back by waiting.
TEST_F(ScanReconcilerTest, AScanWhoseDataAreLostHasFailed) {
  const v1::Scan lost = SendUnreadable(absl::StatusCode::kNotFound);
  EXPECT_EQ(lost.state(), v1::SCAN_STATE_FAILED);
  EXPECT_THAT(lost.state_message(), HasSubstr("has lost its data"));
  EXPECT_EQ(session_->scans().Pending(), 0);
}

}  // namespace
}  // namespace vantage::session
