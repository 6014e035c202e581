#include "core/sensor/scanner_model.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace vantage::sensor {

double ScannerModel::SamplesPerSteradian(double elevation) const {
  const double cos_e = std::max(std::cos(elevation), std::sin(elevation_step));
  return 1.0 / (azimuth_step * elevation_step * cos_e);
}

double ScannerModel::SamplingDensity(double elevation, double cos_incidence, double range) const {
  if (cos_incidence <= 0 || range <= 0) return 0;
  return SamplesPerSteradian(elevation) * cos_incidence / (range * range);
}

double ScannerModel::SamplingDensityAtSine(double sin_elevation, double cos_incidence,
                                           double range) const {
  if (cos_incidence <= 0 || range <= 0) return 0;
  double cos_e = std::sqrt(std::max(0.0, 1 - sin_elevation * sin_elevation));
  // An angle is never less than its sine.
  if (cos_e < elevation_step) cos_e = std::max(cos_e, std::sin(elevation_step));
  return cos_incidence / (azimuth_step * elevation_step * cos_e * range * range);
}

double ScannerModel::MaxSamplingDensity() const {
  const double steepest = std::max(std::abs(elevation_min), std::abs(elevation_max));
  return SamplingDensity(steepest, 1.0, range_min);
}

absl::Status ScannerModel::Validate() const {
  std::vector<std::string> wrong;
  const auto require = [&wrong](bool holds, const char* what) {
    if (!holds) wrong.push_back(what);
  };
  // Comparisons are written so that NaN fails them.
  require(azimuth_span > 0 && azimuth_span <= 2 * kPi + 1e-9, "azimuth_span must be in (0, 2 pi]");
  require(elevation_min >= -kPi / 2 - 1e-9 && elevation_min < elevation_max,
          "elevation_min must be in [-pi/2, elevation_max)");
  require(elevation_max <= kPi / 2 + 1e-9, "elevation_max must be at most pi/2");
  require(azimuth_step >= 1e-6 && azimuth_step <= 0.2, "azimuth_step must be in [1e-6, 0.2] rad");
  require(elevation_step >= 1e-6 && elevation_step <= 0.2,
          "elevation_step must be in [1e-6, 0.2] rad");
  require(range_min > 0 && range_min < range_max, "range_min must be in (0, range_max)");
  require(range_max <= 1000, "range_max must be at most 1000 m");
  require(range_noise > 0 && range_noise <= 1, "range_noise must be in (0, 1] m");
  require(range_noise_ppm >= 0 && range_noise_ppm <= 1e4, "range_noise_ppm must be in [0, 10000]");
  require(max_incidence > 0 && max_incidence < kPi / 2, "max_incidence must be in (0, pi/2)");
  require(clearance > 0 && clearance <= 5, "clearance must be in (0, 5] m");
  require(positioning_error >= 0 && positioning_error <= 5,
          "positioning_error must be in [0, 5] m");
  if (wrong.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("scanner: ", absl::StrJoin(wrong, "; ")));
}

}  // namespace vantage::sensor
