// A job in which a rival chooses the positions: the same scanner, faults, registration, model and
// rules as in a job through the service, without the service.
#ifndef VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_
#define VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_

#include <string>

#include "absl/status/status.h"
#include "client/study/job_diary.h"
#include "client/study/rival.h"
#include "client/study/study_scene.h"
#include "core/parallel/parallel.h"

namespace vantage::study {

// Runs the job to its end and records it in the diary. An error is a fault.
absl::Status RunRivalJob(const StudyScene& scene, uint64_t seed, Rival& rival,
                         parallel::Parallel& parallel, JobDiary& diary);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_
