// Whether a prior is as good as it says (algorithm.md section 9, 'The verdict on an alignment').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_PRIOR_CONSISTENCY_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_PRIOR_CONSISTENCY_H_

#include <Eigen/Geometry>

#include "core/registration/bound/error_bound.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// By what the covariance of a prior, which has one, has to be multiplied for the prior to be as far
// off as it is: where the overlap tells the pose much better than the prior, both are compared. 1
// where it is not farther off than 95 % of priors as good as it says, or where the overlap tells
// too little.
double PriorVarianceFactor(const OverlapGeometry& geometry, const Eigen::Isometry3d& T_world_scan,
                           const sensor::PosePrior& prior);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_PRIOR_CONSISTENCY_H_
