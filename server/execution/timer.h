// Calls functions at a later time.
#ifndef VANTAGE_SERVER_EXECUTION_TIMER_H_
#define VANTAGE_SERVER_EXECUTION_TIMER_H_

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"

namespace vantage::execution {

// One thread: the functions that it calls must be short (post to a pool).
class Timer {
 public:
  using Clock = std::chrono::steady_clock;
  using Id = uint64_t;

  Timer();
  ~Timer() { Stop(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  Id At(Clock::time_point when, std::function<void()> call);
  Id After(Clock::duration delay, std::function<void()> call) {
    return At(Clock::now() + delay, std::move(call));
  }
  // Drops pending calls and those asked for from now on, and waits for a call that runs; afterwards
  // objects that calls refer to may be destroyed. Must not be called from within a call.
  void Stop();
  // Has no effect on a call that was made; that call may still be running.
  void Cancel(Id id);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::pair<Clock::time_point, Id>, std::function<void()>> calls_ ABSL_GUARDED_BY(mutex_);
  std::map<Id, Clock::time_point> when_ ABSL_GUARDED_BY(mutex_);
  Id next_ ABSL_GUARDED_BY(mutex_) = 1;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_TIMER_H_
