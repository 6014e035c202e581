// A coarse map of the directions of a scan in which rays did not come back.
#ifndef VANTAGE_CORE_MODEL_SCAN_HOLE_MAP_H_
#define VANTAGE_CORE_MODEL_SCAN_HOLE_MAP_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/model/scan/range_surface.h"

namespace vantage::model {

// Bins of about three degrees, by azimuth and elevation; a hole is one where half of the rays or
// more did not come back, so single drop-outs don't count.
class HoleMap {
 public:
  HoleMap() = default;
  explicit HoleMap(const RangeSurface& surface);

  // True when there is no hole.
  bool empty() const { return empty_; }
  // False only when there is no hole within `radius` (rad) of a direction (scanner's frame, not
  // zero).
  bool Near(const Eigen::Vector3d& direction, double radius) const;

 private:
  int columns_ = 0;
  int rows_ = 0;
  bool empty_ = true;
  std::vector<uint8_t> hole_;  // by column, then by row
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_HOLE_MAP_H_
