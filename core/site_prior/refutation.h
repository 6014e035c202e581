// What the scans say against a prior, place by place (algorithm.md section 13, 'Refutation').
#ifndef VANTAGE_CORE_SITE_PRIOR_REFUTATION_H_
#define VANTAGE_CORE_SITE_PRIOR_REFUTATION_H_

#include <cstddef>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::site_prior {

// A prior of which more is refuted is not used at all.
inline constexpr double kMostRefuted = 0.35;

struct Refutation {
  // The prior without what is refuted, and without surface that was measured already, a little off.
  model::PlanningView left;
  double agreeing_area = 0;  // m2 of its upright surface over furniture that was measured
  double gone_area = 0;      // m2 of it that is not there: the model knows empty space
  double new_area = 0;       // m2 of measured upright surface over furniture where it has none
  // The share of what is decided that is not there.
  double share() const {
    const double decided = agreeing_area + gone_area;
    return decided > 0 ? gone_area / decided : 0;
  }
};

// `space`: SpaceOf() the prior at its place in the model. Within `accuracy` (m) two surfaces are
// the same. Where surface is gone or new, all that the prior has around is dropped, as far as a few
// times its accuracy; and rooms to which new walls leave no way from what is known. CANCELLED when
// that was requested on the way.
absl::StatusOr<Refutation> Refute(const model::PlanningView& model,
                                  const model::PlanningView& space, double accuracy,
                                  const parallel::Cancellation& cancelled = {});

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_REFUTATION_H_
