// The scripted job, cut off after every step that it makes on its disk.
#ifndef VANTAGE_TESTS_FAULTS_CRASH_POINTS_H_
#define VANTAGE_TESTS_FAULTS_CRASH_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage::faults {

struct CrashPoints {
  size_t steps = 0;                 // writes, syncs, renames and such of the undisturbed job
  size_t crashes = 0;               // restarts after one, each with the rest of the job
  size_t crashes_twice = 0;         // of these, with another crash during the recovery
  std::vector<std::string> faults;  // what was lost or differed, with the point where
};

// Cuts the job off after every `stride`-th step from `first` on, in three ways each
// (crashed_disk.h), below `scratch`. Every fourth time the recovery is cut off, too. `more` says
// whether to go on. An error: the undisturbed job failed.
absl::StatusOr<CrashPoints> CrashAtEveryPoint(const std::string& scratch, size_t first,
                                              size_t stride, uint64_t seed,
                                              const std::function<bool()>& more);

struct DiskFaults {
  size_t faults_made = 0;           // runs in which steps failed
  size_t refusals = 0;              // of these, the client was refused a step
  std::vector<std::string> faults;  // what was lost or differed, with the point where
};

// Lets every step fail from the `stride`-th, twice the `stride`-th ... on, with no room, an I/O
// error or a read-only disk in turn, until the client is refused something; then the disk is well
// again, and the same server goes on to the end. Afterwards another server finds all of it.
absl::StatusOr<DiskFaults> FailAtPoints(const std::string& scratch, size_t first, size_t stride,
                                        const std::function<bool()>& more);

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_CRASH_POINTS_H_
