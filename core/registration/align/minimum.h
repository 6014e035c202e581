// A pose that an alignment can end in.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_MINIMUM_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_MINIMUM_H_

#include <Eigen/Geometry>

namespace vantage::registration {

// Another pose that a start ended in.
struct Minimum {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double score = 0;  // share of the samples that fit, less those that contradict; at most 1
  double contradiction_share = 0;  // SpaceAgreement's; 0 before it was compared with known space
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_MINIMUM_H_
