// A job in which a rival chooses the positions: the same scanner, faults, registration, model and
// rules as in a job through the service, without the service.
#ifndef VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_
#define VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_

#include <string>

#include "absl/status/status.h"
#include "client/study/job_diary.h"
#include "client/study/rival.h"
#include "client/study/scene_prior.h"
#include "client/study/study_scene.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::study {

// Runs the job to its end and records it in the diary. An error is a fault. `prior`: of the site,
// placed by RoughPoints() after the first scan and aligned by all scans so far; its verdicts are
// among the notes. `basis`: where the rival may stand.
absl::Status RunRivalJob(const StudyScene& scene, uint64_t seed, Rival& rival,
                         parallel::Parallel& parallel, JobDiary& diary,
                         planning::StationBasis basis = planning::StationBasis::kKnown,
                         std::optional<ScenePriorKind> prior = std::nullopt);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_RIVAL_JOB_H_
