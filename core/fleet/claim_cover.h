// How much of a view's score is claimed by others already (algorithm.md section 11, 'Joint
// planning').
#ifndef VANTAGE_CORE_FLEET_CLAIM_COVER_H_
#define VANTAGE_CORE_FLEET_CLAIM_COVER_H_

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "core/fleet/claims.h"
#include "core/fleet/fleet_request.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::fleet {

struct CoveredView {
  double score = 0;  // samples, of the view if there were no claims
  double left = 0;   // samples, beyond the claims
  ClaimCover cover;
};

// `claims` in the order of Claims::held(); `made` are views that count as scanned whoever claims
// what, whose gain is in no figure. `heading` (rad) is that of a scanner that sees a sector;
// without it, and for other scanners, what can be gained all around counts. A view that would gain
// nothing is not covered. The view need not be feasible. `site`: what a prior shows, as
// planning::PlanningQuestion has it. INVALID_ARGUMENT: configuration, scanner,
// position or heading.
absl::StatusOr<CoveredView> MeasureCover(
    const model::PlanningView& model, const sensor::ScannerModel& scanner,
    const planning::PlanningConfig& config, const Eigen::Vector3d& position,
    std::span<const PledgedView> claims, parallel::Parallel& parallel,
    std::optional<double> heading = std::nullopt, std::span<const PledgedView> made = {},
    std::shared_ptr<const planning::ExpectedSite> site = nullptr);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_CLAIM_COVER_H_
