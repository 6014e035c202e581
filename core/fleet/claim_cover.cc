#include "core/fleet/claim_cover.h"

#include <algorithm>
#include <vector>

#include "absl/status/status.h"
#include "core/fleet/residual.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/planning_estimate.h"
#include "core/planning/scoring.h"
#include "core/planning/view_report.h"

namespace vantage {

absl::StatusOr<CoveredView> MeasureCover(const PlanningView& model, const ScannerModel& scanner,
                                         const PlanningConfig& config,
                                         const Eigen::Vector3d& position,
                                         std::span<const PledgedView> claims, Parallel& parallel) {
  if (absl::Status valid = ValidateFor(model, scanner, config); !valid.ok()) return valid;
  if (absl::Status fits = CheckPlanningSize(model, config); !fits.ok()) return fits;
  if (!position.allFinite()) {
    return absl::InvalidArgumentError("position must be finite (m, model frame)");
  }
  const Budget budget = Budget::Unlimited();
  const OpaqueGrid grid(model);
  const PatchSet patches = ExtractPatches(model, config, PatchTolerance{}, budget);
  const Scoring scoring(model, grid, patches, scanner, config, parallel);

  uint64_t rays = 0;
  CoveredView covered;
  covered.gain = scoring.scorer().Score(position, scoring.cells(), budget).gain;
  covered.left = covered.gain;
  covered.cover.by_claim.assign(claims.size(), 0);
  if (!(covered.gain > 0)) return covered;
  Residual together(scoring.cells());
  for (size_t k = 0; k < claims.size(); ++k) {
    const SensingConstraints constraints(claims[k].model);
    const BruteForceScorer scorer(constraints, scoring.scene(), model.voxel_size());
    Residual alone(scoring.cells());
    alone.Take(claims[k].position, scorer, budget, rays);
    together.Take(claims[k].position, scorer, budget, rays);
    const double taken = alone.Lowered(0, position, scoring.scorer(), budget, rays).value_or(0);
    covered.cover.by_claim[k] = std::clamp(taken / covered.gain, 0.0, 1.0);
  }
  covered.left = scoring.scorer().Score(position, together.left(), budget).gain;
  covered.cover.together = std::clamp(1 - covered.left / covered.gain, 0.0, 1.0);
  return covered;
}

}  // namespace vantage
