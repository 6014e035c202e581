// Operations that run one after the other, on the planning pool.
#ifndef VANTAGE_SERVER_EXECUTION_STRAND_H_
#define VANTAGE_SERVER_EXECUTION_STRAND_H_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "core/parallel/parallel.h"
#include "server/execution/planning_pool.h"
#include "server/telemetry/log_context.h"

namespace vantage::execution {

// Runs the operations that change a session's model, one at a time. Thread safe. Held by
// shared_ptr: a queued operation keeps the strand alive.
class Strand : public std::enable_shared_from_this<Strand> {
 public:
  using Operation = std::function<void(parallel::Parallel&)>;

  // `pool` must outlive the strand. At most `capacity` operations wait.
  Strand(PlanningPool& pool, std::shared_ptr<PlanningPool::Share> share, size_t capacity);

  // False, and nothing happens, when the queue is full or the strand is closed.
  [[nodiscard]] bool TryPost(Operation operation);
  // Operations waiting or running.
  size_t Size() const;

  // Drops waiting operations and accepts no more; the running operation ends by itself.
  void Close();
  // Waits until nothing runs or waits.
  void WaitUntilIdle();

 private:
  class Turn;
  void Next();
  // The pool has ended: nothing will run any more.
  void Abandon();
  void RunOne(parallel::Parallel& parallel);

  PlanningPool& pool_;
  const std::shared_ptr<PlanningPool::Share> share_;
  const size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  // Each operation has the trace that it was posted for.
  std::deque<std::pair<Operation, telemetry::LogContext>> operations_ ABSL_GUARDED_BY(mutex_);
  bool running_ ABSL_GUARDED_BY(mutex_) = false;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_STRAND_H_
