// What becomes of a scan whose data cannot be had when it is to be merged, or for whose merge there
// is no memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <new>
#include <string>
#include <thread>

#include "server/contract/error.h"
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
  ASSERT_TRUE(session_->scans().Accept(doubtful, {}, {}).ok());
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

// What a server that was killed leaves behind: a scan on which work was begun.
class BegunScanTest : public testing::Test {
 protected:
  // What becomes of a scan when the next server starts, after so many were killed at work on it.
  v1::Scan AfterEnds(int ends, int tries = 2) {
    std::string name;
    {
      fixture::SessionHost host(store_, script_.Make());
      const auto session = fixture::OpenSession(host.registry, "job");
      store_.reading = absl::StatusCode::kUnavailable;
      const v1::PosePrior prior = fixture::PriorAt(2.0, 1.5, 1.4);
      name =
          fixture::SendScan(*session, fixture::EncodedRoom({2.0, 1.5, 1.4}), &prior).value().scan();
      session->WaitUntilIdle();
    }
    for (int i = 0; i < ends; ++i) EXPECT_EQ(store_.BeginWork("job", name).value(), i + 1);
    store_.reading = absl::StatusCode::kOk;
    contract::Limits limits;
    limits.tries = tries;
    host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make(), limits);
    EXPECT_TRUE(host_->registry.LoadAll().ok());
    session_ = host_->registry.Find("job").value();
    session_->WaitUntilIdle();
    return session_->scans().Get(name).value();
  }

  UnreadableStore store_;
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(BegunScanTest, AScanThatEndedTheServerOnceIsTriedAgain) {
  const v1::Scan scan = AfterEnds(1);
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED);
  // Forgotten, now that it has ended.
  EXPECT_EQ(store_.BeginWork("job", scan.name()).value(), 1);
}

TEST_F(BegunScanTest, AScanThatEndedTheServerTwiceIsSetAside) {
  const v1::Scan scan = AfterEnds(2);
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_FAILED);
  EXPECT_THAT(scan.state_message(), HasSubstr("came to its end 2 times"));
  // A person may decide to try it again.
  ASSERT_TRUE(
      session_->scans().SetPose(scan.name(), fixture::PriorAt(2.0, 1.5, 1.4), true, {}).ok());
  session_->WaitUntilIdle();
  EXPECT_EQ(session_->scans().Get(scan.name())->state(), v1::SCAN_STATE_MERGED);
}

TEST_F(BegunScanTest, WithoutALimitItIsTriedForEver) {
  EXPECT_EQ(AfterEnds(5, 0).state(), v1::SCAN_STATE_MERGED);
}

TEST_F(BegunScanTest, AModelThatEndedTheServerTwiceIsNotLoaded) {
  {
    fixture::SessionHost host(store_, script_.Make());
    const auto session = fixture::OpenSession(host.registry, "job");
    ASSERT_TRUE(fixture::SendRoom(*session, {2.0, 1.5, 1.4}).ok());
  }
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(store_.BeginWork("job", "model").ok());
  fixture::SessionHost host(store_, script_.Make());
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const auto session = host.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_FALSE(session->model().loaded());
  const absl::Status why = session->model().WhyNone();
  EXPECT_EQ(contract::ReasonOf(why), "WORK_SET_ASIDE") << why;
  // What needs no model is served.
  EXPECT_EQ(session->Describe().scan_counts().merged_count(), 1);
}

// The system may have no memory in the middle of work.
TEST(OutOfMemoryTest, EndsTheWorkAndNotTheProcess) {
  store::MemoryStore store(64 << 20);
  fixture::Script script;
  Algorithms algorithms = script.Make();
  std::atomic<bool> short_of_memory = true;
  const auto align = algorithms.register_scan;
  algorithms.register_scan = [&](const auto& view, const auto& scan, const auto& last_pose,
                                 auto targets, const auto& config, parallel::Parallel& parallel) {
    parallel.For(8, [&](size_t) {
      if (short_of_memory) throw std::bad_alloc();
    });
    return align(view, scan, last_pose, targets, config, parallel);
  };
  algorithms.make_plan = [](const auto&...) -> absl::StatusOr<planning::Plan> {
    throw std::bad_alloc();
  };
  fixture::SessionHost host(store, algorithms);
  const auto session = fixture::OpenSession(host.registry, "job");
  ASSERT_TRUE(fixture::SendRoom(*session, {2.0, 1.5, 1.4}).ok());
  const v1::PosePrior prior = fixture::PriorAt(3.0, 2.5, 1.4);
  const std::string second =
      fixture::SendScan(*session, fixture::EncodedRoom({3.0, 2.5, 1.4}), &prior).value().scan();
  session->WaitUntilIdle();
  const v1::Scan failed = session->scans().Get(second).value();
  EXPECT_EQ(failed.state(), v1::SCAN_STATE_FAILED);
  EXPECT_THAT(failed.state_message(), HasSubstr("no memory left"));
  // The model may have been half changed: it is loaded anew.
  EXPECT_EQ(contract::ReasonOf(session->MeasureCoverage().status()), "MODEL_LOADING");
  session->WaitUntilIdle();
  EXPECT_TRUE(session->MeasureCoverage().ok());
  v1::CreatePlanRequest create;
  create.set_parent("sessions/job");
  create.mutable_plan()->mutable_time_budget()->set_seconds(1);
  const std::string plan = session->plans().Create(create).value().name();
  while (session->plans().Running() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(session->plans().Get(plan)->state(), v1::PLAN_STATE_FAILED);
  EXPECT_THAT(session->plans().Get(plan)->state_message(), HasSubstr("no memory left"));
  short_of_memory = false;
  EXPECT_TRUE(fixture::SendRoom(*session, {3.0, 2.5, 1.4}).ok());
}

}  // namespace
}  // namespace vantage::session
