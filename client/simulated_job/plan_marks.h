// What a plan says, as marks on a job's picture.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_PLAN_MARKS_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_PLAN_MARKS_H_

#include <string>

#include "absl/functional/function_ref.h"
#include "client/picture/job_picture.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::simulated_job {

// Adds scores, candidates (none where stopping is suggested) and refused views, of those places
// that `shows` accepts (m, world), and takes the plan's required density and separation.
void AddPlanMarks(const v1::PlanResult& result, absl::FunctionRef<bool(const v1::Vector3&)> shows,
                  picture::JobPicture& picture);

// Where to go next, or why nowhere, in a line.
std::string NextLine(const v1::PlanResult& result);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_PLAN_MARKS_H_
