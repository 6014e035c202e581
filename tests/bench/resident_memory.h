// How much memory the process holds.
#ifndef VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_
#define VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_

#include <functional>

namespace vantage::bench {

// Resident memory of the process after free heap memory was returned to the system, MB (1e6 bytes).
double ResidentMegabytes();

// The temporary memory of a call: the peak during the call less the memory after it, MB. Whatever
// the call keeps must outlive it. 0 where the system does not allow the peak to be reset.
double TransientMegabytes(const std::function<void()>& call);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_RESIDENT_MEMORY_H_
