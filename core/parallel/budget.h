// How long work may go on: until a deadline, until an amount of work is done, until somebody asks
// for the best answer so far, or until it is cancelled.
#ifndef VANTAGE_CORE_PARALLEL_BUDGET_H_
#define VANTAGE_CORE_PARALLEL_BUDGET_H_

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <stop_token>

namespace vantage::parallel {

// With a work limit and no deadline, results are the same on any number of threads; a deadline
// gives that promise up.
struct Budget {
  using Clock = std::chrono::steady_clock;

  Clock::time_point deadline = Clock::time_point::max();
  uint64_t work_limit = std::numeric_limits<uint64_t>::max();  // rays
  std::stop_token cancelled;
  // Asks for an answer soon: no more views are evaluated, and the answer is made of those that
  // were.
  std::stop_token hurried;
  bool ends_in_a_hurry = false;
  // The clock of the deadline. Measurements count CPU time with another one, tests steps of work.
  Clock::time_point (*now)() = &Clock::now;

  static Budget Unlimited() { return {}; }
  static Budget Seconds(double seconds) {
    Budget budget;
    budget.deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(seconds));
    return budget;
  }

  // A share of what is left of time and of work when `done` was done; its work limit counts `done`,
  // too.
  Budget Part(double share, uint64_t done) const {
    Budget part = *this;
    if (deadline != Clock::time_point::max()) {
      const auto at = now();
      const auto left = std::max(deadline - at, Clock::duration::zero());
      part.deadline = at + std::chrono::duration_cast<Clock::duration>(share * left);
    }
    if (work_limit != std::numeric_limits<uint64_t>::max()) {
      const uint64_t left = work_limit - std::min(work_limit, done);
      part.work_limit = done + static_cast<uint64_t>(share * static_cast<double>(left));
    }
    return part;
  }
  // The budget of work that ends when an answer is asked for soon.
  Budget Evaluating() const {
    Budget part = *this;
    part.ends_in_a_hurry = true;
    return part;
  }
  // The budget of the work that makes the answer afterwards.
  Budget Concluding() const {
    Budget part = *this;
    if (hurried.stop_requested()) {
      part.deadline = std::min(deadline, now() + std::chrono::milliseconds(500));
    }
    return part;
  }

  // True when work must stop now, whatever its state.
  bool Expired() const {
    return cancelled.stop_requested() || (ends_in_a_hurry && hurried.stop_requested()) ||
           now() >= deadline;
  }
  // Why the budget ended, in words.
  const char* WhyEnded() const {
    return cancelled.stop_requested() ? "cancelled"
           : hurried.stop_requested() ? "ended early on request"
                                      : "the budget ended";
  }
};

}  // namespace vantage::parallel

#endif  // VANTAGE_CORE_PARALLEL_BUDGET_H_
