// What a scan would show of space that nobody has seen, if the planes that it sees of what is known
// went on there (algorithm.md section 9, 'Prediction').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_CONTINUED_SURFACE_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_CONTINUED_SURFACE_H_

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/registration/align/scan_surface.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// `seen`: the known surface that a scan from `position` (m, world) shows, points relative to it and
// axes as the world's, spread (SpreadSamples()). Returns samples in the same frame, some decimetres
// apart, on the floor, ceiling and walls among it, where they would lie in unknown space, in sight
// past all that is known and past each other; at most a thousand.
std::vector<SurfaceSample> ContinuedSurface(const model::PlanningView& model,
                                            std::span<const SurfaceSample> seen,
                                            const Eigen::Vector3d& position,
                                            const sensor::ScannerModel& scanner);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_CONTINUED_SURFACE_H_
