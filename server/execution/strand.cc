#include "server/execution/strand.h"

#include <tuple>
#include <utility>

namespace vantage::execution {

Strand::Strand(PlanningPool& pool, std::shared_ptr<PlanningPool::Share> share, size_t capacity)
    : pool_(pool), share_(std::move(share)), capacity_(capacity) {}

bool Strand::TryPost(Operation operation) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (closed_ || operations_.size() >= capacity_) return false;
    operations_.emplace_back(std::move(operation), telemetry::CurrentLogContext());
    if (running_) return true;
    running_ = true;
  }
  Next();
  return true;
}

size_t Strand::Size() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return operations_.size() + (running_ ? 1 : 0);
}

void Strand::Close() {
  std::deque<std::pair<Operation, telemetry::LogContext>> dropped;
  std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  dropped.swap(operations_);
}

void Strand::WaitUntilIdle() {
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [this]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return !running_; });
}

void Strand::Next() {
  pool_.Submit(
      share_, JobPriority::kModel,
      [self = shared_from_this()](parallel::Parallel& parallel) { self->RunOne(parallel); });
}

void Strand::RunOne(parallel::Parallel& parallel) {
  Operation operation;
  telemetry::LogContext context;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!operations_.empty()) {
      std::tie(operation, context) = std::move(operations_.front());
      operations_.pop_front();
    }
  }
  if (operation) {
    const telemetry::ScopedLogContext scope(std::move(context));
    operation(parallel);
    operation = nullptr;
  }
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (operations_.empty()) {
      running_ = false;
      idle_.notify_all();
      return;
    }
  }
  Next();
}

}  // namespace vantage::execution
