#include "server/execution/task_pool.h"

#include <new>
#include <utility>

namespace vantage::execution {

TaskPool::TaskPool(int threads, size_t capacity) : capacity_(capacity) {
  for (int i = 0; i < (threads < 1 ? 1 : threads); ++i) {
    threads_.emplace_back([this] { Work(); });
  }
}

TaskPool::~TaskPool() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool TaskPool::TryPost(Task task) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (tasks_.size() >= capacity_) return false;
    tasks_.push_back({std::move(task), telemetry::CurrentLogContext()});
  }
  wake_.notify_one();
  return true;
}

void TaskPool::Post(Task task) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    tasks_.push_back({std::move(task), telemetry::CurrentLogContext()});
  }
  wake_.notify_one();
}

size_t TaskPool::waiting() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return tasks_.size();
}

void TaskPool::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock,
               [this]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Posted next = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    {
      const telemetry::ScopedLogContext context(std::move(next.context));
      try {
        next.task();
      } catch (const std::bad_alloc&) {
        // The task says itself what it answers then; here only the process is kept.
      }
      next.task = nullptr;  // the task's captures are released outside the lock
    }
    lock.lock();
  }
}

}  // namespace vantage::execution
