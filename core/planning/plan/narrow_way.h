// A way that is too narrow for the scanner (algorithm.md section 11, 'Narrow ways').
#ifndef VANTAGE_CORE_PLANNING_PLAN_NARROW_WAY_H_
#define VANTAGE_CORE_PLANNING_PLAN_NARROW_WAY_H_

#include <Eigen/Core>
#include <string>

namespace vantage::planning {

// A place that a narrower scanner could be carried to, which would gain much more than any that the
// scanner can be carried to.
struct NarrowWay {
  Eigen::Vector3d narrowest = Eigen::Vector3d::Zero();  // m, on the floor, where the way is
  double width = 0;  // m, of the widest scanner that fits through; a whole number of centimetres
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // m, the best view behind that was looked at
  double model_gain = 0;                            // m^2, of a scan from there
  double gain_without_hidden = 0;                   // m^2: RankedView::gain_without_hidden
};

// For a person. `origin` (m) is added to places.
std::string NarrowWayWords(const NarrowWay& way, const Eigen::Vector3d& origin);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_NARROW_WAY_H_
