#include "server/execution/timer.h"

namespace vantage::execution {

Timer::Timer() : thread_([this] { Work(); }) {}

void Timer::Stop() {
  std::map<std::pair<Clock::time_point, Id>, std::function<void()>> dropped;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    dropped.swap(calls_);
    when_.clear();
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Timer::Id Timer::At(Clock::time_point when, std::function<void()> call) {
  Id id = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    id = next_++;
    if (stopping_) return id;
    calls_.emplace(std::make_pair(when, id), std::move(call));
    when_.emplace(id, when);
  }
  wake_.notify_all();
  return id;
}

void Timer::Cancel(Id id) {
  std::function<void()> dropped;  // destroyed outside the lock
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = when_.find(id);
  if (it == when_.end()) return;
  const auto call = calls_.find({it->second, id});
  dropped = std::move(call->second);
  calls_.erase(call);
  when_.erase(it);
}

void Timer::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopping_) {
    if (calls_.empty()) {
      wake_.wait(lock);
      continue;
    }
    const auto first = calls_.begin();
    const Clock::time_point when = first->first.first;
    if (Clock::now() < when) {
      wake_.wait_until(lock, when);
      continue;
    }
    std::function<void()> call = std::move(first->second);
    when_.erase(first->first.second);
    calls_.erase(first);
    lock.unlock();
    call();
    call = nullptr;
    lock.lock();
  }
}

}  // namespace vantage::execution
