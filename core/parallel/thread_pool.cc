#include "core/parallel/thread_pool.h"

#include <algorithm>
#include <atomic>

namespace vantage::parallel {
namespace {

// Loops follow each other quickly, and waking a thread takes longer than many of them.
template <typename Done>
void WaitAWhile(Done&& done) {
  for (int i = 0; i < 200 && !done(); ++i) std::this_thread::yield();
}

}  // namespace

// One call of For(). It is shared and may outlive the call: a worker that sees it after the last
// index was taken leaves at once, and `body` is used only while indices remain.
struct ThreadPool::Loop {
  Loop(size_t indices, absl::FunctionRef<void(size_t)> call) : count(indices), body(call) {}

  // Takes indices until none is left.
  void Run() {
    for (size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      body(i);
      if (done.fetch_add(1) + 1 == count) {
        std::lock_guard<std::mutex> lock(mutex);
        finished.notify_all();
      }
    }
  }

  const size_t count;
  const absl::FunctionRef<void(size_t)> body;
  std::atomic<size_t> next{0};
  std::atomic<size_t> done{0};
  std::mutex mutex;
  std::condition_variable finished;
};

ThreadPool::ThreadPool(int width) {
  for (int i = 1; i < width; ++i) workers_.emplace_back([this] { Work(); });
}

ThreadPool::~ThreadPool() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::For(size_t count, absl::FunctionRef<void(size_t)> body) {
  if (count == 0) return;
  auto loop = std::make_shared<Loop>(count, body);
  if (count > 1 && !workers_.empty()) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      loops_.push_back(loop);
      ++posted_;
    }
    wake_.notify_all();
  }
  loop->Run();
  WaitAWhile([&] { return loop->done.load() == count; });
  if (loop->done.load() != count) {
    std::unique_lock<std::mutex> lock(loop->mutex);
    loop->finished.wait(lock, [&] { return loop->done.load() == count; });
  }
  std::lock_guard<std::mutex> lock(mutex_);
  loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
}

void ThreadPool::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stopping_ || !loops_.empty(); });
    if (stopping_) return;
    std::shared_ptr<Loop> loop = loops_.front();
    const uint64_t posted = posted_;
    lock.unlock();
    loop->Run();
    lock.lock();
    // All of its indices are taken: nobody else needs to see it.
    loops_.erase(std::remove(loops_.begin(), loops_.end(), loop), loops_.end());
    if (loops_.empty() && posted_ == posted) {
      lock.unlock();
      WaitAWhile([&] { return posted_ != posted; });
      lock.lock();
    }
  }
}

}  // namespace vantage::parallel
