#include "core/sensor/range_image.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

Eigen::Vector3d RangeImage::Direction(int column, int row) const {
  const double a = azimuth[static_cast<size_t>(column)];
  const double e = elevation[static_cast<size_t>(row)];
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

size_t RangeImage::SampleCount() const {
  return static_cast<size_t>(std::count_if(range.begin(), range.end(), IsRange));
}

namespace {

bool RisesStrictly(const std::vector<double>& axis) {
  for (size_t i = 0; i < axis.size(); ++i) {
    if (!std::isfinite(axis[i]) || (i > 0 && !(axis[i] > axis[i - 1]))) return false;
  }
  return true;
}

}  // namespace

absl::Status RangeImage::ValidateAxes() const {
  if (columns() < 2 || rows() < 2) {
    return absl::InvalidArgumentError(absl::StrCat("range image: ", columns(), " columns x ",
                                                   rows(), " rows; at least 2 x 2 are needed"));
  }
  if (!RisesStrictly(azimuth)) {
    return absl::InvalidArgumentError("range image: azimuth must be finite and rise strictly");
  }
  if (!RisesStrictly(elevation)) {
    return absl::InvalidArgumentError("range image: elevation must be finite and rise strictly");
  }
  if (!(azimuth.back() - azimuth.front() < 2 * kPi)) {
    return absl::InvalidArgumentError("range image: azimuth must span less than a full turn");
  }
  if (elevation.front() < -kPi / 2 - 1e-6 || elevation.back() > kPi / 2 + 1e-6) {
    return absl::InvalidArgumentError("range image: elevation must lie within -90 to 90 degrees");
  }
  if (!(native_azimuth_step > 0) || !(native_elevation_step > 0) ||
      !std::isfinite(native_azimuth_step) || !std::isfinite(native_elevation_step)) {
    return absl::InvalidArgumentError(
        "range image: native_azimuth_step and native_elevation_step must be positive, in rad");
  }
  return absl::OkStatus();
}

absl::Status RangeImage::Validate() const {
  if (absl::Status axes = ValidateAxes(); !axes.ok()) return axes;
  if (range.size() != cells()) {
    return absl::InvalidArgumentError(absl::StrCat("range image: ", range.size(), " ranges for ",
                                                   columns(), " x ", rows(), " cells"));
  }
  for (const size_t size : {appearance.intensity.size(), appearance.colour.size()}) {
    if (size != 0 && size != cells()) {
      return absl::InvalidArgumentError(
          absl::StrCat("range image: intensity or colour of ", size, " cells of ", cells()));
    }
  }
  size_t samples = 0;
  for (const float value : range) {
    if (!std::isfinite(value) || (value < 0 && value != kNoInformation)) {
      return absl::InvalidArgumentError(
          "range image: a cell must hold a finite range in metres, no return or no information");
    }
    samples += IsRange(value) ? 1 : 0;
  }
  if (samples == 0) return absl::InvalidArgumentError("range image: no cell holds a range");
  return absl::OkStatus();
}

}  // namespace vantage::sensor
