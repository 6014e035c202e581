// Budgets in CPU time of the thread that works, for measurements of single threads.
#ifndef VANTAGE_TESTS_BENCH_CPU_BUDGET_H_
#define VANTAGE_TESTS_BENCH_CPU_BUDGET_H_

#include <ctime>

#include "core/parallel/budget.h"

namespace vantage::bench {

inline parallel::Budget::Clock::time_point ThreadCpuNow() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return parallel::Budget::Clock::time_point(std::chrono::seconds(time.tv_sec) +
                                             std::chrono::nanoseconds(time.tv_nsec));
}

// A budget that starts now, for the calling thread.
inline parallel::Budget CpuBudget(double seconds) {
  parallel::Budget budget;
  budget.now = &ThreadCpuNow;
  budget.deadline = ThreadCpuNow() + std::chrono::duration_cast<parallel::Budget::Clock::duration>(
                                         std::chrono::duration<double>(seconds));
  return budget;
}

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CPU_BUDGET_H_
