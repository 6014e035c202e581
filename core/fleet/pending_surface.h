// Which scans must be in before another one registers (algorithm.md sections 9 and 11).
#ifndef VANTAGE_CORE_FLEET_PENDING_SURFACE_H_
#define VANTAGE_CORE_FLEET_PENDING_SURFACE_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/fleet/remaining_gain.h"
#include "core/parallel/budget.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"

namespace vantage::fleet {

// What the steps of the remaining gain, scans that are pending, are expected to add to the surface
// that scans are aligned to: where they look at false surface that nothing has been missed at yet,
// some surface is taken to be. That is a guess, and the only one there is: what lies behind is not
// known. Holes are left out, since rays went in there and none came back. References are kept.
class PendingSurface {
 public:
  PendingSurface(const planning::PlanningProblem& problem, const planning::OverlapSurface& overlap);

  struct Verdict {
    registration::RegistrationVerdict verdict;
    // Steps that it needs; none: it registers as things are, or not at all.
    std::vector<size_t> waits_for;
  };
  // The verdict on a scan from `view`, counting what the steps so far are expected to add only
  // where it fails without: then those that can be done without are left out again, the latest
  // first. Nothing when the budget expired. Adds to `rays`.
  std::optional<Verdict> Judge(const Eigen::Vector3d& view, const RemainingGain& remaining,
                               const registration::RegistrationConfig& config,
                               const parallel::Budget& budget, uint64_t& rays);

 private:
  planning::CellArrays Of(const RemainingGain& remaining, const std::vector<size_t>& steps) const;

  const planning::PlanningProblem& problem_;
  const planning::OverlapSurface& overlap_;
  std::vector<uint32_t> at_;  // by deficient cell: its index in the problem's scored cells
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_PENDING_SURFACE_H_
