// How long work may go on: until a deadline, until an amount of work is done, or until cancelled.
#ifndef VANTAGE_CORE_PARALLEL_BUDGET_H_
#define VANTAGE_CORE_PARALLEL_BUDGET_H_

#include <chrono>
#include <cstdint>
#include <limits>
#include <stop_token>

namespace vantage {

// With a work limit and no deadline, results are the same on any number of threads; a deadline
// gives that promise up (the work done is reported so that it can be repeated).
struct Budget {
  using Clock = std::chrono::steady_clock;

  Clock::time_point deadline = Clock::time_point::max();
  uint64_t work_limit = std::numeric_limits<uint64_t>::max();  // rays
  std::stop_token cancelled;
  // The clock of the deadline. Measurements count CPU time with another one, tests steps of work.
  Clock::time_point (*now)() = &Clock::now;

  static Budget Unlimited() { return {}; }
  static Budget Seconds(double seconds) {
    Budget budget;
    budget.deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(seconds));
    return budget;
  }

  // True when work must stop now, whatever its state.
  bool Expired() const { return cancelled.stop_requested() || now() >= deadline; }
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PARALLEL_BUDGET_H_
