// A scan file read in this process and by a confined reader: both must say the same, to the bit and
// to the word, but for what a terminal would obey.
#ifndef VANTAGE_TESTS_CORE_SENSOR_READ_BOTH_WAYS_H_
#define VANTAGE_TESTS_CORE_SENSOR_READ_BOTH_WAYS_H_

#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/sensor/confined_scan_file.h"
#include "core/sensor/scan_file.h"
#include "tests/support/printable.h"

namespace vantage::sensor {

// By their bytes: the sign of a zero counts.
template <typename T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline void ExpectSameScan(const ImportedScan& a, const ImportedScan& b) {
  EXPECT_TRUE(SameBytes(a.image.azimuth, b.image.azimuth));
  EXPECT_TRUE(SameBytes(a.image.elevation, b.image.elevation));
  EXPECT_TRUE(SameBytes(a.image.range, b.image.range));
  EXPECT_TRUE(SameBytes(a.image.appearance.intensity, b.image.appearance.intensity));
  EXPECT_TRUE(SameBytes(a.image.appearance.colour, b.image.appearance.colour));
  EXPECT_EQ(a.image.full_turn, b.image.full_turn);
  EXPECT_EQ(a.image.native_azimuth_step, b.image.native_azimuth_step);
  EXPECT_EQ(a.image.native_elevation_step, b.image.native_elevation_step);
  ASSERT_EQ(a.T_world_scan.has_value(), b.T_world_scan.has_value());
  if (a.T_world_scan) {
    EXPECT_TRUE(a.T_world_scan->matrix() == b.T_world_scan->matrix());
  }
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.duplicates, b.duplicates);
  EXPECT_EQ(a.far, b.far);
  EXPECT_EQ(a.loose, b.loose);
  EXPECT_EQ(a.apart, b.apart);
  EXPECT_EQ(a.resampled, b.resampled);
  EXPECT_EQ(a.leaning, b.leaning);
  EXPECT_EQ(a.appearance.intensity, b.appearance.intensity);
  EXPECT_EQ(a.appearance.colour, b.appearance.colour);
  const ScannerModel& s = a.scanner;
  const ScannerModel& t = b.scanner;
  EXPECT_EQ(s.name, t.name);
  EXPECT_EQ(s.azimuth_span, t.azimuth_span);
  EXPECT_EQ(s.elevation_min, t.elevation_min);
  EXPECT_EQ(s.elevation_max, t.elevation_max);
  EXPECT_EQ(s.azimuth_step, t.azimuth_step);
  EXPECT_EQ(s.elevation_step, t.elevation_step);
  EXPECT_EQ(s.range_min, t.range_min);
  EXPECT_EQ(s.range_max, t.range_max);
  EXPECT_EQ(s.range_noise, t.range_noise);
  EXPECT_EQ(s.range_noise_ppm, t.range_noise_ppm);
  EXPECT_EQ(s.max_incidence, t.max_incidence);
  EXPECT_EQ(s.clearance, t.clearance);
  EXPECT_EQ(s.positioning_error, t.positioning_error);
}

// Each set-up as this process reads it, or why it does not; one status where it cannot be opened.
inline std::vector<absl::StatusOr<ImportedScan>> ReadBothWays(
    const std::string& path, const std::optional<Eigen::Vector3d>& station = {},
    const ImportLimits& limits = {}) {
  uint64_t here_reached = 0;
  uint64_t there_reached = 0;
  const auto to = [](uint64_t& reached) {
    return [&reached](uint64_t position, uint64_t) { reached += position; };
  };
  const absl::StatusOr<ScanFile> here = ScanFile::Open(path, station, to(here_reached));
  absl::StatusOr<ConfinedScanFile> there =
      ConfinedScanFile::Open(path, station, {}, to(there_reached));
  EXPECT_EQ(there.status(), test_support::Printable(here.status()));
  EXPECT_EQ(there_reached, here_reached);
  if (!here.ok()) return {here.status()};
  if (!there.ok()) return {there.status()};
  EXPECT_EQ(there->setups(), here->setups());
  std::vector<absl::StatusOr<ImportedScan>> scans;
  for (size_t setup = 0; setup < here->setups().size(); ++setup) {
    scans.push_back(here->Read(setup, limits));
    const absl::StatusOr<ImportedScan> confined = there->Read(setup, limits);
    EXPECT_EQ(confined.status(), test_support::Printable(scans.back().status()));
    EXPECT_EQ(there_reached, here_reached);
    if (confined.ok() && scans.back().ok()) ExpectSameScan(*confined, *scans.back());
  }
  return scans;
}

}  // namespace vantage::sensor

#endif  // VANTAGE_TESTS_CORE_SENSOR_READ_BOTH_WAYS_H_
