// A whole job, the same each time, on a store in a folder: sessions, uploads in pieces, scans
// merged and withdrawn, plans, snapshots, a deletion. It goes on from wherever an earlier run was
// stopped.
#ifndef VANTAGE_TESTS_FAULTS_SCRIPTED_JOB_H_
#define VANTAGE_TESTS_FAULTS_SCRIPTED_JOB_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage::faults {

// What a client was told: it must be so for ever after.
struct Told {
  std::vector<std::string> events;         // of the session, serialised
  std::map<std::string, int64_t> uploads;  // bytes that are durable, by upload
  bool deleted = false;                    // the other session is no more
};

// How the job ended, without its times.
struct JobEnding {
  std::vector<std::string> scans;
  std::string plan;   // the ranking, serialised
  std::string model;  // every brick
  bool operator==(const JobEnding&) const = default;
};

// Loads what is in `folder`, checks that it holds what `known` says, and goes on to the job's
// end. `told` is called after every step with all that the client then knows. When the store
// refuses a step, `mend` is asked whether to go on, after it did something about that, with the
// same server. An error says what was lost (DATA_LOSS) or what failed.
absl::StatusOr<JobEnding> RunScriptedJob(
    const std::string& folder, const Told& known, const std::function<void(const Told&)>& told,
    const std::function<bool(const absl::Status&)>& mend = [](const absl::Status&) {
      return false;
    });

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_SCRIPTED_JOB_H_
