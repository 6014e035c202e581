// Results of the core as golden text, without the times that they took.
#ifndef VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_
#define VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_

#include "core/fleet/joint_plan.h"
#include "core/model/partial_model.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/planner.h"
#include "core/registration/registration.h"
#include "tests/support/golden.h"

namespace vantage::golden {

void Describe(const Eigen::Isometry3d& pose, test_support::GoldenText& out);
void Describe(const registration::RegistrationVerdict& verdict, test_support::GoldenText& out);
void Describe(const registration::RegistrationResult& result, test_support::GoldenText& out);
void Describe(const model::MergeReport& report, test_support::GoldenText& out);
// Its content in words, and its bytes.
void Describe(const model::PartialModel& model, parallel::Parallel& parallel,
              test_support::GoldenText& out);
void Describe(const planning::RankedView& view, test_support::GoldenText& out);
void Describe(const planning::Coverage& coverage, test_support::GoldenText& out);
void Describe(const planning::Plan& plan, test_support::GoldenText& out);
void Describe(const planning::ViewEvaluation& evaluation, test_support::GoldenText& out);
void Describe(const fleet::JointPlan& plan, test_support::GoldenText& out);

}  // namespace vantage::golden

#endif  // VANTAGE_TESTS_CORE_GOLDEN_DESCRIBE_H_
