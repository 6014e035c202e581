// Where a scan can have been made as far as its prior may be wrong (algorithm.md section 9,
// 'Alignment').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_PRIOR_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_PRIOR_SEARCH_H_

#include <Eigen/Geometry>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/scan_surface.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// Of a prior, as far as it may be wrong: one in ninety is farther off on a plane.
inline constexpr double kSigmasOfPrior = 3;

// How far a prior may be wrong.
struct PriorReach {
  double shift = 1.5;                 // m, across the floor
  double rise = 0.15;                 // m, up and down
  double turn = sensor::Radians(15);  // rad, about the vertical
};
// Three standard deviations, at most 200 m. Of a prior that does not say how good it is, these:
// people show a spot on a plan to half a metre, and a heading to five degrees.
PriorReach ReachOf(const sensor::PosePrior& prior);

struct PriorSearch {
  std::vector<Eigen::Isometry3d> places;  // T_world_scan, the best first
  bool more_places = false;               // others fit half as well as the best, and are left out
  double radius = 0;                      // m around the prior that were searched, across the floor
  bool whole = true;                      // that is all that the prior allows
};

// The best places within that reach; of a reach that would be too much work, as much as is nearest
// to the prior. `field` covers what they reach.
PriorSearch SearchAroundPrior(const model::PlanningView& model, const CorrespondenceField& field,
                              const ScanSurface& surface, double spacing,
                              const sensor::PosePrior& prior, parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_PRIOR_SEARCH_H_
