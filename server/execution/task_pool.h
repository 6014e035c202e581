// Threads for short tasks: request handlers, and the steps of streams. Apart from gRPC's threads,
// which must never wait, and from the planning pool, whose work is long.
#ifndef VANTAGE_SERVER_EXECUTION_TASK_POOL_H_
#define VANTAGE_SERVER_EXECUTION_TASK_POOL_H_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/telemetry/log_context.h"

namespace vantage::execution {

class TaskPool {
 public:
  using Task = std::function<void()>;

  // `threads` >= 1; at most `capacity` tasks wait.
  TaskPool(int threads, size_t capacity);
  // Runs the queued tasks, then joins the threads.
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  // False, and nothing happens, when the queue is full.
  [[nodiscard]] bool TryPost(Task task);

  // For the next step of work that was already admitted (a stream has at most one such step at a
  // time, so their number is bounded by the streams). Never refused.
  void Post(Task task);

  size_t waiting() const;
  size_t capacity() const { return capacity_; }

 private:
  // Each task has the trace that it was posted for.
  struct Posted {
    Task task;
    telemetry::LogContext context;
  };
  void Work();

  const size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Posted> tasks_ ABSL_GUARDED_BY(mutex_);
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_TASK_POOL_H_
