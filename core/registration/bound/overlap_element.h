// What a view would see of the surface that is known.
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_OVERLAP_ELEMENT_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_OVERLAP_ELEMENT_H_

#include <Eigen/Core>
#include <cstdint>

namespace vantage::registration {

// A true-surface voxel that the view would see.
struct OverlapElement {
  Eigen::Vector3f position;  // m, its centroid
  Eigen::Vector3f normal;    // unit
  // That a scan from the view would put on it. 0: too few for an alignment to find its plane; then
  // it holds nothing, but the bound is for it, too.
  float samples = 0;
  uint32_t model_samples = 0;  // that the model's centroid rests on
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_OVERLAP_ELEMENT_H_
