// The walls of a floor plan that is a picture.
#ifndef VANTAGE_CORE_SITE_PRIOR_PLAN_PICTURE_H_
#define VANTAGE_CORE_SITE_PRIOR_PLAN_PICTURE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/site_prior/floor_plan.h"

namespace vantage::site_prior {

// A PNG of any kind, transparent being white: what is darker than `darkest` (0 black, 1 white) is
// wall, but for letters and specks. `metres`: of a pixel. The origin is the picture's upper left
// corner, y up. INVALID_ARGUMENT: it is damaged, or too large.
absl::StatusOr<PlanRaster> ReadPlanPicture(absl::string_view bytes, double metres, double darkest);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PLAN_PICTURE_H_
