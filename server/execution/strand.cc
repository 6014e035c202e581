#include "server/execution/strand.h"

#include <new>
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

// A pool that ends drops what it has not begun. What waits may keep whoever owns the strand alive,
// so without its turn it is let go.
class Strand::Turn {
 public:
  explicit Turn(std::shared_ptr<Strand> strand) : strand_(std::move(strand)) {}
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  ~Turn() {
    if (strand_) strand_->Abandon();
  }
  void Run(parallel::Parallel& parallel) { std::exchange(strand_, nullptr)->RunOne(parallel); }

 private:
  std::shared_ptr<Strand> strand_;  // null once it has run
};

void Strand::Abandon() {
  Close();
  std::lock_guard<std::mutex> lock(mutex_);
  running_ = false;
  idle_.notify_all();
}

void Strand::Next() {
  // Shared, since a job can be copied.
  pool_.Submit(share_, JobPriority::kModel,
               [turn = std::make_shared<Turn>(shared_from_this())](parallel::Parallel& parallel) {
                 turn->Run(parallel);
               });
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
    try {
      operation(parallel);
    } catch (const std::bad_alloc&) {
      // The operation is over, and those behind it have their turn.
    }
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
