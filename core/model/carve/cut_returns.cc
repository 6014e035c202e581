#include "core/model/carve/cut_returns.h"

#include <algorithm>
#include <limits>

namespace vantage::model {

double DistanceToSiteLimit(const ModelConfig& config, const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double face =
        direction[axis] > 0 ? config.max_half_extent[axis] : -config.max_half_extent[axis];
    nearest = std::min(nearest, (face - origin[axis]) / direction[axis]);
  }
  return std::max(nearest, 0.0);
}

CutReturns CutReturnsBeyondLimits(const ModelConfig& config, const sensor::ScannerModel& scanner,
                                  const Eigen::Isometry3d& T_model_scan,
                                  OpenRangeSurface& surface) {
  CutReturns cut;
  const Eigen::Vector3d origin = T_model_scan.translation();
  // No ray that ends nearer than the nearest face can be beyond it.
  const double inside = (config.max_half_extent - origin.cwiseAbs()).minCoeff();
  for (int c = 0; c < surface.columns(); ++c) {
    for (int r = 0; r < surface.rows(); ++r) {
      if (!surface.Returned(c, r)) continue;
      const auto range = static_cast<double>(surface.at(c, r));
      if (range <= scanner.range_max && range <= inside) continue;
      const double limit =
          DistanceToSiteLimit(config, origin, T_model_scan.linear() * surface.Direction(c, r));
      if (range > limit && limit <= scanner.range_max) {
        surface.EndAt(c, r, static_cast<float>(std::min(range, scanner.range_max)),
                      UnknownReason::kSite);
        ++cut.beyond_site;
      } else if (range > scanner.range_max) {
        surface.EndAt(c, r, static_cast<float>(scanner.range_max), UnknownReason::kImage);
        ++cut.beyond_range;
      }
    }
  }
  return cut;
}

}  // namespace vantage::model
