// Which scans must be in before another one registers (algorithm.md sections 9 and 11).
#ifndef VANTAGE_CORE_FLEET_WAITING_H_
#define VANTAGE_CORE_FLEET_WAITING_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/fleet/residual.h"
#include "core/parallel/budget.h"
#include "core/planning/patches.h"
#include "core/planning/registration_check.h"
#include "core/planning/scoring.h"

namespace vantage {

// What the steps of a residual are expected to add to the surface that scans are aligned to: where
// they look at false surface that nothing has been missed at yet, some surface is taken to be. That
// is a guess, and the only one there is: what lies behind is not known. Holes are left out, since
// rays went in there and none came back. References are kept.
class ExpectedSurface {
 public:
  ExpectedSurface(const PatchSet& patches, const Scoring& scoring, const OverlapSurface& overlap);

  struct Verdict {
    RegistrationVerdict verdict;
    // Steps that it needs; none: it registers as things are, or not at all.
    std::vector<size_t> waits_for;
  };
  // The verdict on a scan from `view`, counting what the steps so far are expected to add only
  // where it fails without: then those that can be done without are left out again, the latest
  // first. Nothing when the budget expired. Adds to `rays`.
  std::optional<Verdict> Judge(const Eigen::Vector3d& view, const Residual& residual,
                               const RegistrationConfig& config, const Budget& budget,
                               uint64_t& rays);

 private:
  CellArrays Of(const Residual& residual, const std::vector<size_t>& steps) const;

  const PatchSet& patches_;
  const Scoring& scoring_;
  const OverlapSurface& overlap_;
  std::vector<uint32_t> at_;  // by needy cell: its index in the scoring's cells
};

}  // namespace vantage

#endif  // VANTAGE_CORE_FLEET_WAITING_H_
