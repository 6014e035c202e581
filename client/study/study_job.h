// One job of a study, by any planner.
#ifndef VANTAGE_CLIENT_STUDY_STUDY_JOB_H_
#define VANTAGE_CLIENT_STUDY_STUDY_JOB_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/study/planner_list.h"
#include "client/study/study_scene.h"
#include "core/parallel/parallel.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

// Runs it to its end on the calling thread and `parallel`. `server` (host:port) is asked by
// planners of ours; their session is deleted afterwards. An error is a fault, not a poor job.
absl::StatusOr<study_records::v1::JobRecord> RunStudyJob(const StudyScene& scene,
                                                         const StudyPlanner& planner, uint64_t seed,
                                                         const std::string& server,
                                                         parallel::Parallel& parallel);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_STUDY_JOB_H_
