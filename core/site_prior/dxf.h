// The walls of a floor plan that is a DXF file.
#ifndef VANTAGE_CORE_SITE_PRIOR_DXF_H_
#define VANTAGE_CORE_SITE_PRIOR_DXF_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/site_prior/floor_plan.h"

namespace vantage::site_prior {

// Lines and polylines, also those of blocks where they are inserted; not what doors, furniture,
// dimensions and texts are drawn with: arcs and circles, and layers and blocks that are named for
// such. `unit`: m for 1 of the file's coordinates; 0: what the file says ($INSUNITS), or m where it
// says nothing. INVALID_ARGUMENT: it has no such line, or makes no building by that unit.
absl::StatusOr<PlanRaster> ReadDxf(absl::string_view bytes, double unit);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_DXF_H_
