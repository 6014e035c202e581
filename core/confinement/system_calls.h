// The system calls that are left to a process that only computes.
#ifndef VANTAGE_CORE_CONFINEMENT_SYSTEM_CALLS_H_
#define VANTAGE_CORE_CONFINEMENT_SYSTEM_CALLS_H_

#include "absl/status/status.h"

namespace vantage::confinement {

// From now on all threads of this process may read what is open, write to descriptors 0
// to 2, take and give back memory that holds no code, and end. What libraries ask out of habit
// (limits, the terminal, the number of processors) fails with EPERM. Anything else, such as a
// socket, a file to be opened or a process, ends the process with SIGSYS. FAILED_PRECONDITION: the
// kernel has no seccomp, or the processor is not x86-64 or 64-bit Arm.
absl::Status LeaveFewSystemCalls();

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_SYSTEM_CALLS_H_
