// Whether the scans show what a prior shows, and where it lies by them (algorithm.md section 13,
// 'Aligning a prior').
#ifndef VANTAGE_CORE_SITE_PRIOR_ALIGNMENT_H_
#define VANTAGE_CORE_SITE_PRIOR_ALIGNMENT_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::site_prior {

// How far around its placement a prior is sought.
inline constexpr double kSearchRadius = 3.0;  // m, in plan
inline constexpr double kSearchYaw = 0.18;    // rad: 10 degrees
inline constexpr double kSearchScale = 0.03;  // share
inline constexpr double kSearchHeight = 2.0;  // m

enum class AlignmentVerdict {
  kNotEnoughSeen,  // too few walls were measured, or the prior fits in several places
  kAligned,
  kNotAligned,  // enough was seen, and it is not what the prior shows: the prior is not used
};

struct Alignment {
  AlignmentVerdict verdict = AlignmentVerdict::kNotEnoughSeen;
  PriorPose pose;        // the best that was found; the placement where nothing was sought
  double wall_area = 0;  // m2 of wall that was measured over most furniture
  double agreeing = 0;   // the share of it that lies on walls of the prior
  double missing = 0;    // the share of walls of the prior, where something is known, that are not
                         // there
  double residual = 0;   // m, root mean square of what agrees
  double rival = 0;      // how well the second best place fits, as a share of the best
  std::string message;   // for people
};

// Seeks the prior, of which `space` is SpaceOf() in its own frame, around its placement. Nothing of
// the prior is ever registered to: the scans stay where they are. `accuracy`: m that its surface is
// off where it is right. A function of its arguments alone. CANCELLED when that was requested on
// the way.
absl::StatusOr<Alignment> Align(const model::PlanningView& model, const model::PlanningView& space,
                                const PriorPose& placement, double accuracy,
                                const parallel::Cancellation& cancelled = {});

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_ALIGNMENT_H_
