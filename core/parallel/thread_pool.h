// A fixed set of threads behind the Parallel interface.
#ifndef VANTAGE_CORE_PARALLEL_THREAD_POOL_H_
#define VANTAGE_CORE_PARALLEL_THREAD_POOL_H_

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "core/parallel/parallel.h"

namespace vantage::parallel {

// For() may be called from several threads at once; loops share the workers, first come first
// served. std::mutex rather than absl::Mutex: the thread sanitizer understands it (Debian's absl is
// not instrumented).
class ThreadPool final : public Parallel {
 public:
  // `width` counts the calling thread: width - 1 workers are started. Values below 1 become 1.
  explicit ThreadPool(int width);
  ~ThreadPool() override;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int width() const override { return static_cast<int>(workers_.size()) + 1; }
  void For(size_t count, absl::FunctionRef<void(size_t)> body) override;

 private:
  struct Loop;
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::shared_ptr<Loop>> loops_;  // guarded by mutex_
  std::atomic<uint64_t> posted_{0};          // calls of For() so far
  bool stopping_ = false;                    // guarded by mutex_
  std::vector<std::thread> workers_;
};

}  // namespace vantage::parallel

#endif  // VANTAGE_CORE_PARALLEL_THREAD_POOL_H_
