// The scanners at which thresholds of model and registration are tested. What depends on noise or
// on the distance between samples has to hold at each of them.
#ifndef VANTAGE_TESTS_SUPPORT_THREE_SCANNERS_H_
#define VANTAGE_TESTS_SUPPORT_THREE_SCANNERS_H_

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>
#include <vector>

#include "core/sensor/scan.h"

namespace vantage::test_support {

struct ScannerCase {
  const char* name;
  double step;   // rad, between rays, both ways
  double noise;  // m, one sigma of a range
};

// What test names show.
inline void PrintTo(const ScannerCase& scanner, std::ostream* out) { *out << scanner.name; }

inline constexpr std::array<ScannerCase, 3> kThreeScanners = {
    {{"0.1 degrees, 1 mm", sensor::Radians(0.1), 0.001},
     {"0.25 degrees, 3 mm", sensor::Radians(0.25), 0.003},
     {"1 degree, 1 cm", sensor::Radians(1.0), 0.010}}};

// Of a sector, so that a scan of the densest has a million samples and not six: `span` rad of
// azimuth around +x, `rise` rad up and down from the horizon.
inline sensor::ScannerModel Sector(const ScannerCase& of, double span, double rise) {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = of.step;
  scanner.range_noise = of.noise;
  scanner.range_noise_ppm = 0;
  scanner.azimuth_span = span;
  scanner.elevation_min = -rise;
  scanner.elevation_max = rise;
  return scanner;
}

// A scan in closed form. `cast(origin, direction)` is the distance to the first surface, m; 0 where
// there is none.
template <typename Cast>
sensor::Scan ScanBy(const sensor::ScannerModel& scanner, const Eigen::Isometry3d& T_world_scan,
                    uint64_t seed, const Cast& cast) {
  sensor::Scan scan;
  scan.scanner = scanner;
  sensor::RangeImage& image = scan.image;
  const auto lines = [](double low, double high, double step, std::vector<double>& angles) {
    const int count = static_cast<int>(std::lround((high - low) / step));
    for (int i = 0; i < count; ++i) angles.push_back(low + (i + 0.5) * (high - low) / count);
  };
  lines(-0.5 * scanner.azimuth_span, 0.5 * scanner.azimuth_span, scanner.azimuth_step,
        image.azimuth);
  lines(scanner.elevation_min, scanner.elevation_max, scanner.elevation_step, image.elevation);
  image.full_turn = scanner.azimuth_span > 2 * sensor::kPi - 0.5 * scanner.azimuth_step;
  image.native_azimuth_step = scanner.azimuth_step;
  image.native_elevation_step = scanner.elevation_step;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, scanner.range_noise);
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const double range =
          cast(T_world_scan.translation(), T_world_scan.linear() * image.Direction(c, r));
      const bool measured = range > scanner.range_min && range < scanner.range_max;
      image.range.push_back(measured ? static_cast<float>(range + noise(random))
                                     : sensor::RangeImage::kNoReturn);
    }
  }
  return scan;
}

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_THREE_SCANNERS_H_
