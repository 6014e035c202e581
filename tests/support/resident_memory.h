// How much memory the process holds.
#ifndef VANTAGE_TESTS_SUPPORT_RESIDENT_MEMORY_H_
#define VANTAGE_TESTS_SUPPORT_RESIDENT_MEMORY_H_

#include <functional>

namespace vantage::test_support {

// Resident memory of the process after free heap memory was returned to the system, MB (1e6 bytes).
double ResidentMegabytes();

// From now on PeakMegabytes() counts, after free heap memory was returned. False where the system
// does not allow that, and under sanitizers: they hold several times what the program asks for.
bool ResetPeak();
// The most that the process held since then, MB.
double PeakMegabytes();

// The temporary memory of a call: the peak during the call less the memory after it, MB. Whatever
// the call keeps must outlive it. 0 where the system does not allow the peak to be reset.
double TransientMegabytes(const std::function<void()>& call);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_RESIDENT_MEMORY_H_
