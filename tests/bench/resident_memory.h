// How much memory the process holds.
#ifndef VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_
#define VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_

#include <functional>

namespace vantage::bench {

// MB (1e6 bytes) of the process in memory, after what is free in the heap has gone back to the
// system: what still counts is held, or lies between what is.
double ResidentMegabytes();

// The most that was in memory during a call above what is still in memory after it, MB: what the
// call needed for a while. Whatever the call keeps must outlive it. 0 where the system does not let
// the peak be reset.
double TransientMegabytes(const std::function<void()>& call);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_
