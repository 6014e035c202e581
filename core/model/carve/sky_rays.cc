#include "core/model/carve/sky_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/model/carve/cut_returns.h"
#include "core/model/scan/sky.h"

namespace vantage::model {
namespace {

// No ray that a plan aims at surface passes far above it or far beyond it, so that empty space
// there would cost memory (it grows with the cube of the range) and serve nobody.
constexpr double kAroundReturns = 5.0;    // m, more than a storey: what the next scan finds on top
constexpr double kShareOfReturns = 0.99;  // the farthest may be a bird or the next village

// An upright cylinder around the scanner.
struct Cylinder {
  double radius = 0;  // m
  double height = 0;  // m over the scanner

  // The distance to it along a unit direction whose vertical part is `up`.
  double DistanceTo(double up) const {
    const double level = std::sqrt(std::max(0.0, 1 - up * up));
    const double side = level > 0 ? radius / level : std::numeric_limits<double>::infinity();
    return up > 0 ? std::min(side, height / up) : side;
  }
};

double Quantile(std::vector<double>& values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                       kShareOfReturns * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Cylinder AroundReturns(const RangeSurface& surface, const Eigen::Vector3d& up) {
  std::vector<double> aside;
  std::vector<double> above;
  for (int c = 0; c < surface.columns(); ++c) {
    for (int r = 0; r < surface.rows(); ++r) {
      if (!surface.Returned(c, r)) continue;
      const Eigen::Vector3d point = static_cast<double>(surface.at(c, r)) * surface.Direction(c, r);
      above.push_back(point.dot(up));
      aside.push_back((point - above.back() * up).norm());
    }
  }
  if (aside.empty()) return {kAroundReturns, kAroundReturns};
  return {Quantile(aside) + kAroundReturns, std::max(Quantile(above), 0.0) + kAroundReturns};
}

}  // namespace

size_t EndSkyRays(const ModelConfig& config, const sensor::ScannerModel& scanner,
                  const Eigen::Isometry3d& T_model_scan, OpenRangeSurface& surface) {
  const Eigen::Vector3d up = T_model_scan.linear().row(2);
  const std::vector<SkyRay> rays = FindSkyRays(surface, scanner, up);
  if (rays.empty()) return 0;
  const Cylinder around = AroundReturns(surface, up);
  size_t count = 0;
  for (const SkyRay& ray : rays) {
    const Eigen::Vector3d direction = surface.Direction(ray.column, ray.row);
    const double end =
        std::min({static_cast<double>(ray.range), around.DistanceTo(direction.dot(up)),
                  DistanceToSiteLimit(config, T_model_scan.translation(),
                                      T_model_scan.linear() * direction)});
    if (!(end > 0)) continue;
    surface.EndAt(ray.column, ray.row, static_cast<float>(end), ray.beyond);
    ++count;
  }
  return count;
}

}  // namespace vantage::model
