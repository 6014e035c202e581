// A sample of a scan and the surface that it lies on.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_H_

#include <Eigen/Core>

namespace vantage::registration {

// A sample of the scan and the piece of the model's surface it lies on.
struct Correspondence {
  Eigen::Vector3d point;    // m, world: the sample at the aligned pose
  Eigen::Vector3d normal;   // unit, world: mean of the sample's and the voxel's
  double residual = 0;      // m, of the point from the plane, along the normal
  double variance = 0;      // m^2, of the residual, from what is known of sensor and model
  double normal_angle = 0;  // rad, between the sample's and the voxel's normal
  double cells = 0;         // samples of the image that it stands for
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_H_
