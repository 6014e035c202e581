// A shutdown keeps its time: what can be done after the next start is put off.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

// Calls before each blob is read.
class WatchedStore final : public store::MemoryStore {
 public:
  WatchedStore() : MemoryStore(64 << 20) {}
  absl::StatusOr<std::string> GetBlob(const std::string& sha256) const override {
    ++reads;
    if (before_read) before_read();
    return MemoryStore::GetBlob(sha256);
  }
  std::function<void()> before_read;
  mutable std::atomic<int> reads{0};
};

class DrainTest : public testing::Test {
 protected:
  static constexpr int kScans = 4;

  DrainTest() {
    limits_.snapshots_per_session = 0;  // scans are merged again by each start
    fixture::SessionHost host(store_, script_.Make(), limits_);
    const auto session = fixture::OpenSession(host.registry, "job");
    for (int i = 0; i < kScans; ++i) {
      EXPECT_TRUE(fixture::SendRoom(*session, {1.0 + 0.5 * i, 1.5, 1.4}).ok());
    }
  }

  WatchedStore store_;
  fixture::Script script_;
  contract::Limits limits_;
};

TEST_F(DrainTest, LoadingStopsBetweenScans) {
  {
    fixture::SessionHost host(store_, script_.Make(), limits_);
    store_.reads = 0;
    store_.before_read = [&] {
      while (!host.registry.Find("job").ok()) std::this_thread::yield();
      host.registry.BeginDrain();
    };
    ASSERT_TRUE(host.registry.LoadAll().ok());
    const auto session = host.registry.Find("job").value();
    session->WaitUntilIdle();
    EXPECT_EQ(store_.reads, 1);
    EXPECT_FALSE(session->model().loaded());
    EXPECT_TRUE(host.registry.WaitUntilIdle(std::chrono::seconds(10)));
  }
  store_.before_read = nullptr;
  store_.reads = 0;
  fixture::SessionHost host(store_, script_.Make(), limits_);
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const auto session = host.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_EQ(store_.reads, kScans);
  EXPECT_TRUE(session->model().loaded());
}

// Two scans wait; the first is under way when the time of the shutdown is over.
TEST_F(DrainTest, WhatOutlastsItIsLeftToTheNextStart) {
  std::string first;
  std::string second;
  {
    fixture::SessionHost host(store_, script_.Make(), limits_);
    ASSERT_TRUE(host.registry.LoadAll().ok());
    const auto session = host.registry.Find("job").value();
    session->WaitUntilIdle();
    script_.PauseAlignments();
    const v1::PosePrior prior = fixture::PriorAt(1.0, 2.0, 1.4);
    const std::string room = fixture::EncodedRoom({1.0, 2.0, 1.4}, 3.0);
    first = fixture::SendScan(*session, room, &prior).value().scan();
    const v1::PosePrior beside = fixture::PriorAt(1.5, 2.0, 1.4);
    second = fixture::SendScan(*session, fixture::EncodedRoom({1.5, 2.0, 1.4}, 3.0), &beside)
                 .value()
                 .scan();
    script_.WaitForAlignment();
    host.registry.BeginDrain();
    EXPECT_FALSE(host.registry.WaitUntilIdle(std::chrono::milliseconds(20)));
    host.registry.GiveUp();
    // The end of the process is not the scan's fault.
    EXPECT_EQ(store_.BeginWork("job", first).value(), 1);
    ASSERT_TRUE(store_.EndWork("job", first).ok());
    script_.ReleaseAlignments();
    session->WaitUntilIdle();
    EXPECT_EQ(session->scans().Get(second)->state(), v1::SCAN_STATE_RECEIVED);
  }
  fixture::SessionHost host(store_, script_.Make(), limits_);
  ASSERT_TRUE(host.registry.LoadAll().ok());
  const auto session = host.registry.Find("job").value();
  session->WaitUntilIdle();
  EXPECT_EQ(session->scans().Get(first)->state(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(session->scans().Get(second)->state(), v1::SCAN_STATE_MERGED);
}

}  // namespace
}  // namespace vantage::session
