// What a process gives up before it reads what a stranger wrote.
#ifndef VANTAGE_CORE_CONFINEMENT_CONFINE_H_
#define VANTAGE_CORE_CONFINEMENT_CONFINE_H_

#include <sys/types.h>

#include <cstdint>

#include "absl/status/status.h"

namespace vantage::confinement {

struct Bounds {
  pid_t parent = 0;           // with whose end this process ends
  uint64_t memory_bytes = 0;  // of address space, from here on
  uint64_t cpu_seconds = 0;   // from its start on
};

// Of this process, for good. What is required, or FAILED_PRECONDITION naming what is missing:
//   system_calls.h; no privileges by programs that are executed; no core dumps and no look from
//   outside (ptrace, /proc/PID/mem); bounds on processor time and, but for sanitizers, which need
//   terabytes of it, on address space; the end of the parent is its own.
// What comes on top, where machine and container allow it, so that a hole in one wall is not a
// door: a user namespace, in it networks and other resources of its own, and no capabilities;
// Landlock; no descriptors, files and processes by limits; to be the first to go where memory runs
// out.
absl::Status Confine(const Bounds& bounds);

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_CONFINE_H_
