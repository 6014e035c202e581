// Whose file is read next. Files are read one at a time for each tenant, or, where callers are not
// told apart, for each session, some at the same time, in processes of their own (core/confinement)
// that share the processor by the system's means.
#ifndef VANTAGE_SERVER_SESSION_FILE_READINGS_H_
#define VANTAGE_SERVER_SESSION_FILE_READINGS_H_

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace vantage::session {

// Thread safe.
class FileReadings {
 public:
  // True: it is to end soon, without a result.
  using GivenUp = std::function<bool()>;
  // Returns after how long it is to be called again; 0: it is done.
  using Work = std::function<std::chrono::milliseconds(const GivenUp& given_up)>;

  // `at_once` >= 1.
  explicit FileReadings(size_t at_once) : at_once_(at_once) {}
  ~FileReadings();  // as End()
  FileReadings(const FileReadings&) = delete;
  FileReadings& operator=(const FileReadings&) = delete;

  // `who`: the tenant, or the session of one that has none. Of those who wait, who has had least of
  // the time is next. Nothing happens once it was stopped.
  void Post(const std::string& who, const std::string& session, Work work);
  // Forgets what waits of a session, gives up what is under way, and returns when that has ended.
  void Forget(const std::string& session);
  // Gives up all that is under way; nothing is begun any more.
  void Stop();
  // The same, and returns when nothing is under way. Not to be called by work.
  void End();
  // Nothing is under way.
  bool Rests() const;

  // Room on the disk that uploads of files were promised and have not used yet, bytes. Takes
  // `bytes` of what `free` says is left beside that. RESOURCE_EXHAUSTED (STORE_FULL): there is not
  // enough; errors of `free`.
  absl::Status Promise(int64_t bytes, absl::FunctionRef<absl::StatusOr<int64_t>()> free);
  void Use(int64_t bytes) { promised_ -= bytes; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Reading {
    std::string who;
    std::string session;
    Work work;
    Clock::time_point not_before;
    std::shared_ptr<std::atomic<bool>> given_up = std::make_shared<std::atomic<bool>>(false);
  };

  void WorkOff();
  // The next that may begin; the end of `waiting_` where there is none, and when to look again.
  std::list<Reading>::iterator Next(Clock::time_point& look) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool AnyOf(const std::string& session) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const size_t at_once_;
  std::atomic<int64_t> promised_{0};
  std::mutex promise_mutex_;  // one promise at a time
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Reading> waiting_ ABSL_GUARDED_BY(mutex_);
  std::list<Reading> running_ ABSL_GUARDED_BY(mutex_);
  // Time that each had who has something here, s.
  std::map<std::string, double> had_ ABSL_GUARDED_BY(mutex_);
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_FILE_READINGS_H_
