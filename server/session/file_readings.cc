#include "server/session/file_readings.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/contract/error.h"

namespace vantage::session {
namespace {

// Below the planning pool's threads (5): with three files at a time they have two thirds of a busy
// machine. Processes inherit it.
constexpr int kReadingNiceness = 10;
// Of the disk, left for logs and scans, bytes; of a small one, a sixteenth of what is free.
constexpr int64_t kLeftOnDisk = int64_t{256} << 20;

}  // namespace

FileReadings::~FileReadings() { End(); }

void FileReadings::End() {
  Stop();
  std::vector<std::thread> threads;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    threads.swap(threads_);
  }
  for (std::thread& thread : threads) thread.join();
}

void FileReadings::Post(const std::string& who, const std::string& session, Work work) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (stopped_) return;
  Reading reading;
  reading.who = who;
  reading.session = session;
  reading.work = std::move(work);
  waiting_.push_back(std::move(reading));
  if (threads_.size() < at_once_ && threads_.size() < waiting_.size() + running_.size()) {
    threads_.emplace_back([this] { WorkOff(); });
  }
  changed_.notify_all();
}

std::list<FileReadings::Reading>::iterator FileReadings::Next(Clock::time_point& look) {
  const Clock::time_point now = Clock::now();
  auto next = waiting_.end();
  for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
    const bool busy = std::any_of(running_.begin(), running_.end(),
                                  [&](const Reading& other) { return other.who == it->who; });
    if (busy) continue;
    if (it->not_before > now) {
      look = std::min(look, it->not_before);
      continue;
    }
    if (next == waiting_.end() || had_[it->who] < had_[next->who]) next = it;
  }
  return next;
}

void FileReadings::WorkOff() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kReadingNiceness);
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopped_) {
    Clock::time_point look = Clock::now() + std::chrono::hours(1);
    const auto next = Next(look);
    if (next == waiting_.end()) {
      changed_.wait_until(lock, look);
      continue;
    }
    running_.splice(running_.end(), waiting_, next);
    const std::shared_ptr<std::atomic<bool>> given_up = next->given_up;
    lock.unlock();
    const Clock::time_point begun = Clock::now();
    const std::chrono::milliseconds again =
        next->work([&given_up] { return given_up->load(std::memory_order_relaxed); });
    const std::chrono::duration<double> took = Clock::now() - begun;
    lock.lock();
    had_[next->who] += took.count();
    const std::string who = next->who;
    if (again.count() > 0 && !*given_up && !stopped_) {
      next->not_before = Clock::now() + again;
      waiting_.splice(waiting_.end(), running_, next);
    } else {
      // What the work holds ends without the lock.
      std::list<Reading> ended;
      ended.splice(ended.end(), running_, next);
      const auto of_same = [&](const Reading& other) { return other.who == who; };
      if (std::none_of(waiting_.begin(), waiting_.end(), of_same)) had_.erase(who);
      changed_.notify_all();
      lock.unlock();
      ended.clear();
      lock.lock();
    }
    changed_.notify_all();
  }
}

bool FileReadings::AnyOf(const std::string& session) const {
  return std::any_of(running_.begin(), running_.end(),
                     [&](const Reading& reading) { return reading.session == session; });
}

void FileReadings::Forget(const std::string& session) {
  std::list<Reading> forgotten;  // ends without the lock
  std::unique_lock<std::mutex> lock(mutex_);
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const auto next = std::next(it);
    if (it->session == session) forgotten.splice(forgotten.end(), waiting_, it);
    it = next;
  }
  for (Reading& reading : running_) {
    if (reading.session == session) *reading.given_up = true;
  }
  changed_.wait(lock, [&] { return !AnyOf(session); });
  lock.unlock();
}

void FileReadings::Stop() {
  std::list<Reading> forgotten;
  std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  forgotten.swap(waiting_);
  for (Reading& reading : running_) *reading.given_up = true;
  changed_.notify_all();
}

bool FileReadings::Rests() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return running_.empty();
}

absl::Status FileReadings::Promise(int64_t bytes,
                                   absl::FunctionRef<absl::StatusOr<int64_t>()> free) {
  std::lock_guard<std::mutex> lock(promise_mutex_);
  const absl::StatusOr<int64_t> there = free();
  if (!there.ok()) return there.status();
  const int64_t left =
      std::max<int64_t>(0, *there - promised_ - std::min(kLeftOnDisk, *there / 16));
  if (bytes <= left) {
    promised_ += bytes;
    return absl::OkStatus();
  }
  return contract::ErrorWithReason(
      absl::StatusCode::kResourceExhausted, "STORE_FULL",
      absl::StrFormat(
          "reading the file takes %.1f MiB of the server's disk, and %.1f MiB are left: "
          "delete sessions, or have its operator make room",
          static_cast<double>(bytes) / (1 << 20), static_cast<double>(left) / (1 << 20)),
      {{"needed_bytes", absl::StrCat(bytes)}, {"free_bytes", absl::StrCat(left)}});
}

}  // namespace vantage::session
