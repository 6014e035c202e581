// Whether more of a scan would lie within the noise of its surface a little away from where an
// alignment ended (algorithm.md section 9, 'Alignment').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_NARROW_FIT_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_NARROW_FIT_H_

#include <Eigen/Core>
#include <span>

#include "core/registration/align/correspondence.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

struct NarrowFit {
  // Of the pose, about `about`; zero where nothing fits better than what there is.
  sensor::Vector6d change = sensor::Vector6d::Zero();
  Eigen::Vector3d about = Eigen::Vector3d::Zero();  // m, world
  bool better = false;
};

// Alignments end where robust steps hold themselves; two such places can lie a centimetre apart,
// when something that lies near a surface without being of it (what a mirror shows that hangs
// askew) pulls as hard as the surface does. Robust steps from some scales away, either way along
// each direction of the pose, with the correspondences as they are. `scale`: of Tukey's weights, m,
// where the alignment ended.
NarrowFit FindNarrowFit(std::span<const Correspondence> correspondences, double scale);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_NARROW_FIT_H_
