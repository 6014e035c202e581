// Returns beyond the range model or beyond the site's limit: no reason to refuse a scan, and no
// surface either (algorithm.md section 4, 'What is cut').
#ifndef VANTAGE_CORE_MODEL_CARVE_CUT_RETURNS_H_
#define VANTAGE_CORE_MODEL_CARVE_CUT_RETURNS_H_

#include <Eigen/Geometry>
#include <cstddef>

#include "core/model/scan/range_surface.h"
#include "core/model/view/model_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

// How many returns of a scan gave no surface, by what they were beyond: the nearer of the two.
struct CutReturns {
  size_t beyond_range = 0;  // ScannerModel::range_max
  size_t beyond_site = 0;   // ModelConfig::max_half_extent
};

// The distance at which a ray from `origin` (m, model frame, within the site) in the unit direction
// `direction` leaves the site's box, m.
double DistanceToSiteLimit(const ModelConfig& config, const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction);

// Ends the rays of such returns at the range model's limit, or where they returned outside the
// site: carving ends at the site's limit, voxel by voxel.
CutReturns CutReturnsBeyondLimits(const ModelConfig& config, const sensor::ScannerModel& scanner,
                                  const Eigen::Isometry3d& T_model_scan, OpenRangeSurface& surface);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_CUT_RETURNS_H_
