#include "core/model/reflections/reflected_return.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vantage::model {

std::optional<ReturnTest::Measured> ReturnTest::MeasuredTowards(
    const Eigen::Vector3d& point) const {
  const AngularAxis::Position a = surface_.azimuth().Locate(std::atan2(point.y(), point.x()));
  const AngularAxis::Position e =
      surface_.elevation().Locate(std::atan2(point.z(), point.head<2>().norm()));
  if (!a.inside || !e.inside || !surface_.Returned(a.nearest(), e.nearest())) return std::nullopt;
  const Measured measured{Point(a.nearest(), e.nearest()),
                          NormalAround(surface_, a.nearest(), e.nearest())};
  if (measured.normal.squaredNorm() < 0.5) return std::nullopt;
  return measured;
}

Back ReturnTest::Compare(const Eigen::Vector3d& point, double agreement) const {
  const double clearly_empty = WellBehind();  // m before what was measured there
  // m: where depths around differ by more, nothing can be said. More than a chair or a shelf is
  // deep; of one surface only at rays of a degree that meet it at 75 degrees, from four metres on.
  constexpr double kRagged = 0.5;
  const AngularAxis::Position a = surface_.azimuth().Locate(std::atan2(point.y(), point.x()));
  const AngularAxis::Position e =
      surface_.elevation().Locate(std::atan2(point.z(), point.head<2>().norm()));
  if (!a.inside || !e.inside) return Back::kHidden;
  float low = std::numeric_limits<float>::infinity();
  float high = 0;
  bool all = true;
  for (int dc = -1; dc <= 1; ++dc) {
    for (int dr = -1; dr <= 1; ++dr) {
      const int r = e.nearest() + dr;
      int c = a.nearest() + dc;
      if (surface_.azimuth().closed()) c = (c + surface_.columns()) % surface_.columns();
      if (c < 0 || c >= surface_.columns() || r < 0 || r >= surface_.rows()) continue;
      if (!surface_.Returned(c, r)) {
        all = false;
        continue;
      }
      low = std::min(low, surface_.at(c, r));
      high = std::max(high, surface_.at(c, r));
    }
  }
  if (!(high > 0)) return Back::kHidden;
  const double distance = point.norm();
  if (distance < static_cast<double>(low) - clearly_empty) {
    return all ? Back::kContradicts : Back::kHidden;
  }
  if (static_cast<double>(high - low) > kRagged) return Back::kHidden;
  const bool agrees = distance > static_cast<double>(low) - agreement &&
                      distance < static_cast<double>(high) + agreement;
  return agrees ? Back::kAgrees : Back::kHidden;
}

}  // namespace vantage::model
