// Results of the core as golden text, without the times that they took.
#ifndef VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_
#define VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_

#include "core/fleet/joint_plan.h"
#include "core/model/partial_model.h"
#include "core/planning/planner.h"
#include "core/registration/registration.h"
#include "tests/support/golden.h"

namespace vantage {

void Describe(const Eigen::Isometry3d& pose, GoldenText& out);
void Describe(const RegistrationVerdict& verdict, GoldenText& out);
void Describe(const RegistrationResult& result, GoldenText& out);
void Describe(const MergeReport& report, GoldenText& out);
// What it says, and its bytes.
void Describe(const PartialModel& model, Parallel& parallel, GoldenText& out);
void Describe(const RankedView& view, GoldenText& out);
void Describe(const Coverage& coverage, GoldenText& out);
void Describe(const Plan& plan, GoldenText& out);
void Describe(const ViewEvaluation& evaluation, GoldenText& out);
void Describe(const JointPlan& plan, GoldenText& out);

}  // namespace vantage

#endif  // VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_
