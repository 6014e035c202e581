// Things that were moved between scans, told apart from a pose that is wrong (algorithm.md section
// 9, 'The verdict on an alignment').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_MOVED_THINGS_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_MOVED_THINGS_H_

#include <span>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// What tells. Whoever came hides furniture; at a wrong pose the furniture is gone.
struct MovedThings {
  double contradicting =
      0;  // m2, to a quarter, of the scan's surface: in known-empty space, or behind walls
  double missed_share = 0;  // of its samples in known space: that fit nothing there
  double seen_again = 0;    // m2 of known surface that the scan sees
  double seen_through = 0;  // m2 of known surface that the scan sees through

  // Whether what contradicts was moved since, as far as can be told.
  bool Explain() const;
  // Whether these, at one pose, leave no room for `others` at another, which things that were moved
  // would explain: next to nothing was moved here, and much more of what is known is seen again.
  bool SayMoreThan(const MovedThings& others) const;
};

// At a pose of `scan`, whose surface is thinned to one sample per cube of side `spacing` (m).
// `samples` are a fair selection of it, `agreements` what they say there. Takes some milliseconds.
MovedThings FindMovedThings(const model::PlanningView& model, const sensor::Scan& scan,
                            const ScanSurface& surface, double spacing,
                            const Eigen::Isometry3d& T_world_scan,
                            std::span<const SurfaceSample> samples,
                            std::span<const SampleAgreement> agreements,
                            parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_MOVED_THINGS_H_
