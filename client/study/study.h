// A study: scenes x planners x seeds. Each combination is a job whose record is kept; a job with a
// record is not done again.
#ifndef VANTAGE_CLIENT_STUDY_STUDY_H_
#define VANTAGE_CLIENT_STUDY_STUDY_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/study/job_store.h"
#include "client/study/study_scene.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

struct StudyPlan {
  std::vector<std::string> scenes;
  std::vector<std::string> planners;
  int seeds = 5;  // 1, 2, ...
  StudySettings settings;
  std::string data_folder;     // of scenes that are files
  int jobs = 0;                // at the same time; 0: one per core
  double no_job_after = 0;     // s: none is begun later; 0: no limit
  std::string server_program;  // to start those from
};

struct StudyProgress {
  int done = 0;   // jobs, those found done included
  int total = 0;  // jobs
  std::string doing;
};

// The results of a study.
struct StudyOutcome {
  std::vector<study_records::v1::JobRecord> records;  // in the order of the study
  std::vector<std::string> faults;  // 'scene planner seed: why' of jobs that failed
  int missing = 0;                  // jobs that were not begun or failed
};

// Does the jobs that `store` has no good record of. `progress` is called from one thread at a time.
// A job that fails does not end the study. NOT_FOUND: no such scene or planner.
absl::StatusOr<StudyOutcome> RunStudy(const StudyPlan& plan, const JobStore& store,
                                      const std::function<void(const StudyProgress&)>& progress);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_STUDY_H_
