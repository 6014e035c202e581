// Whose turn it is, where many would have the same few threads at once.
#ifndef VANTAGE_SERVER_WEB_TURNS_H_
#define VANTAGE_SERVER_WEB_TURNS_H_

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/base/thread_annotations.h"

namespace vantage::web {

// When something happens on a site, all the pages that follow it are told in the same moment. The
// messages of so many streams would stand in the way of calls that people wait for; so only some
// are handed to the threads at a time, in the order in which they came. Thread safe.
class Turns {
 public:
  // Given back when the turn is over.
  using Turn = std::shared_ptr<void>;
  // Begins the work, and does not throw. What it hands the turn to keeps it until it is done.
  using Begin = std::function<void(Turn)>;

  explicit Turns(size_t at_once) : left_(at_once) {}

  // Calls `begin` at once, or on the thread on which a turn ends. Who waits is bounded by whoever
  // calls: a stream has one message at a time.
  void Wait(Begin begin) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (left_ == 0) {
        waiting_.push_back(std::move(begin));
        return;
      }
      --left_;
    }
    begin(NewTurn());
  }

 private:
  Turn NewTurn() {
    return {nullptr, [this](void*) { End(); }};
  }

  void End() {
    Begin next;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (waiting_.empty()) {
        ++left_;
        return;
      }
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    next(NewTurn());
  }

  std::mutex mutex_;
  size_t left_ ABSL_GUARDED_BY(mutex_);
  std::deque<Begin> waiting_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_TURNS_H_
