#include "core/planning/plan/narrow_way.h"

#include "absl/strings/str_format.h"

namespace vantage::planning {

std::string NarrowWayWords(const NarrowWay& way, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d narrowest = way.narrowest + origin;
  const Eigen::Vector3d place = way.place + origin;
  const std::string unseen =
      way.gain_without_hidden > way.model_gain
          ? absl::StrFormat(", of which %.2f m2 are seen today", way.model_gain)
          : "";
  return absl::StrFormat(
      "a scan from (%.2f, %.2f, %.2f), behind the way %.2f m wide at (%.2f, %.2f), would bring "
      "%.2f m2 to the required density%s: set scanner_width_m to %.2f if you can carry it through",
      place.x(), place.y(), place.z(), way.width, narrowest.x(), narrowest.y(),
      way.gain_without_hidden, unseen, way.width);
}

}  // namespace vantage::planning
