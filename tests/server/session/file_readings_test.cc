#include "server/session/file_readings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/contract/error.h"

namespace vantage::session {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;

constexpr milliseconds kDone(0);

// Work that says when it runs, and ends when it is told to or given up.
class Stage {
 public:
  FileReadings::Work Work(const std::string& name) {
    return [this, name](const FileReadings::GivenUp& given_up) {
      std::unique_lock<std::mutex> lock(mutex_);
      begun_.push_back(name);
      ++running_;
      most_ = std::max(most_, running_);
      changed_.notify_all();
      while (!free_ && !given_up()) changed_.wait_for(lock, milliseconds(1));
      --running_;
      changed_.notify_all();
      return kDone;
    };
  }
  void Free() {
    std::lock_guard<std::mutex> lock(mutex_);
    free_ = true;
    changed_.notify_all();
  }
  void AwaitBegun(size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return begun_.size() >= count; });
  }
  std::vector<std::string> begun() {
    std::lock_guard<std::mutex> lock(mutex_);
    return begun_;
  }
  int most() {
    std::lock_guard<std::mutex> lock(mutex_);
    return most_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> begun_;
  int running_ = 0;
  int most_ = 0;
  bool free_ = false;
};

TEST(FileReadings, OneOfATenantIsReadAtATimeAndSomeInAll) {
  Stage stage;
  FileReadings readings(2);
  for (const char* name : {"a1", "a2", "b1", "c1"}) {
    readings.Post(std::string(1, name[0]), "session", stage.Work(name));
  }
  // A second one of the first tenant waits behind all others.
  stage.AwaitBegun(2);
  EXPECT_THAT(stage.begun(), testing::UnorderedElementsAre("a1", "b1"));
  stage.Free();
  stage.AwaitBegun(4);
  EXPECT_EQ(stage.most(), 2);
}

TEST(FileReadings, WhoHasHadLeastIsNext) {
  Stage first;
  Stage rest;
  FileReadings readings(1);
  rest.Free();
  readings.Post("a", "s", first.Work("a1"));
  first.AwaitBegun(1);
  readings.Post("a", "s", rest.Work("a2"));
  readings.Post("b", "s", rest.Work("b1"));
  std::this_thread::sleep_for(milliseconds(5));  // a has had some time, however little
  first.Free();
  rest.AwaitBegun(2);
  EXPECT_THAT(rest.begun(), ElementsAre("b1", "a2"));
}

TEST(FileReadings, WorkThatHasToWaitComesAgain) {
  std::mutex mutex;
  std::condition_variable changed;
  int times = 0;
  FileReadings readings(1);
  readings.Post("a", "s", [&](const FileReadings::GivenUp&) {
    std::lock_guard<std::mutex> lock(mutex);
    changed.notify_all();
    return ++times < 3 ? milliseconds(1) : kDone;
  });
  std::unique_lock<std::mutex> lock(mutex);
  changed.wait(lock, [&] { return times == 3; });
}

TEST(FileReadings, WhatIsForgottenHasEnded) {
  Stage stage;
  FileReadings readings(1);
  readings.Post("a", "gone", stage.Work("running"));
  stage.AwaitBegun(1);
  readings.Post("a", "gone", stage.Work("waiting"));
  readings.Post("a", "other", stage.Work("of another session"));
  readings.Forget("gone");
  stage.AwaitBegun(2);
  EXPECT_THAT(stage.begun(), ElementsAre("running", "of another session"));
}

TEST(FileReadings, NothingBeginsOnceItWasStopped) {
  Stage stage;
  FileReadings readings(1);
  readings.Post("a", "s", stage.Work("running"));
  stage.AwaitBegun(1);
  readings.Post("b", "s", stage.Work("waiting"));
  readings.End();
  EXPECT_TRUE(readings.Rests());
  readings.Post("c", "s", stage.Work("late"));
  EXPECT_THAT(stage.begun(), ElementsAre("running"));
}

TEST(FileReadings, RoomIsPromisedOnce) {
  FileReadings readings(1);
  const auto free = [] { return absl::StatusOr<int64_t>(1600); };  // a sixteenth stays
  ASSERT_TRUE(readings.Promise(1000, free).ok());
  const absl::Status full = readings.Promise(501, free);
  EXPECT_EQ(contract::ReasonOf(full), "STORE_FULL") << full;
  EXPECT_TRUE(readings.Promise(500, free).ok());
  readings.Use(1000);
  EXPECT_TRUE(readings.Promise(1000, free).ok());
  EXPECT_EQ(readings.Promise(1, [] { return absl::UnavailableError("no disk"); }).code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace vantage::session
