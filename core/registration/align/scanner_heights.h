// How high a scanner stands, by the floors that scan and model show (algorithm.md section 9,
// 'Global registration').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_

#include <vector>

#include "core/model/view/planning_view.h"
#include "core/registration/align/floor_plane.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// How far a tripod set up by eye leans at most, rad: the floor of a scan is sought within it.
inline constexpr double kMaxTilt = sensor::Radians(12);
// m, up and down, that tripods differ in height.
inline constexpr double kHeightOverStation = 0.3;

// z of the scanner, m: over each large floor of the model as high as over the scan's own. Without
// one, near the heights of the stations.
std::vector<double> ScannerHeights(const model::PlanningView& model, const FloorPlane* floor);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_
