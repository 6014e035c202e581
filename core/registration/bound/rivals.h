// Other poses at which a scan may have been made (algorithm.md section 9, 'The verdict on an
// alignment').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_RIVALS_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_RIVALS_H_

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/align.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/bound/registration_result.h"

namespace vantage::registration {

// The least share of what the best pose explains that a rival explains (rivals.cc says more).
inline constexpr double kLeastRivalShare = 0.4;

// Samples of the surface, and how each agrees with what is known at the aligned pose.
struct SamplesAtBest {
  std::span<const SurfaceSample> samples;
  std::span<const SampleAgreement> agreements;
};

// The scan at `pose` beside `best`; `samples` of its surface.
RivalPose RivalOf(const Eigen::Isometry3d& pose, double fit_share, const Eigen::Isometry3d& best,
                  std::span<const SurfaceSample> samples);

// Takes out those near rivals that are no minima of their own: refined by all samples, and by the
// surfaces alone, they end where the scan is. Minima are found with fewer, some of which the edge
// of a frame holds beside it.
void LeaveOutWhatEndsAtTheBest(const model::PlanningView& model, const ScanSurface& surface,
                               const RegistrationConfig& config, parallel::Parallel& parallel,
                               Alignment& alignment);

// Those of the alignment's rivals that nothing known refutes, the best fit first.
std::vector<RivalPose> OpenRivals(const model::PlanningView& model, const ScanSurface& surface,
                                  const Alignment& alignment, const SamplesAtBest& at_best,
                                  parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_RIVALS_H_
