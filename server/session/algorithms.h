// The core's algorithms as a session calls them: a seam, so that tests can say what an alignment or
// a plan comes to.
#ifndef VANTAGE_SERVER_SESSION_ALGORITHMS_H_
#define VANTAGE_SERVER_SESSION_ALGORITHMS_H_

#include <functional>
#include <span>

#include "absl/status/statusor.h"
#include "core/fleet/claim_cover.h"
#include "core/fleet/joint_plan.h"
#include "core/planning/planner.h"
#include "core/registration/registration.h"
#include "core/registration/targets.h"

namespace vantage {

struct Algorithms {
  std::function<absl::StatusOr<Levelling>(const Scan&)> level;
  std::function<absl::StatusOr<RegistrationResult>(const PlanningView&, const Scan&,
                                                   const PosePrior&, std::span<const TargetTie>,
                                                   const RegistrationConfig&, Parallel&)>
      register_scan;
  std::function<absl::StatusOr<Plan>(const PlanningView&, const ScannerModel&,
                                     const PlanningConfig&, const Budget&, Parallel&, PlanProgress)>
      make_plan;
  std::function<absl::StatusOr<ViewEvaluation>(const PlanningView&, const ScannerModel&,
                                               const PlanningConfig&, const Eigen::Vector3d&,
                                               Parallel&)>
      evaluate_view;
  std::function<Coverage(const PlanningView&, const PlanningConfig&)> measure_coverage;
  std::function<absl::StatusOr<JointPlan>(const PlanningView&, const FleetRequest&,
                                          const PlanningConfig&, const Budget&, Parallel&,
                                          PlanProgress)>
      make_joint_plan;
  std::function<absl::StatusOr<CoveredView>(const PlanningView&, const ScannerModel&,
                                            const PlanningConfig&, const Eigen::Vector3d&,
                                            std::span<const PledgedView>, Parallel&)>
      measure_cover;

  // The core's own.
  static Algorithms Core();
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_SESSION_ALGORITHMS_H_
