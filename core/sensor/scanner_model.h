// What a scanner can measure (algorithm.md section 3).
#ifndef VANTAGE_CORE_SENSOR_SCANNER_MODEL_H_
#define VANTAGE_CORE_SENSOR_SCANNER_MODEL_H_

#include <numbers>
#include <string>

#include "absl/status/status.h"

namespace vantage::sensor {

inline constexpr double kPi = std::numbers::pi;
constexpr double Radians(double degrees) { return degrees * kPi / 180.0; }
constexpr double Degrees(double radians) { return radians * 180.0 / kPi; }

// An upright panoramic scanner: one centre of projection, z up, azimuth counter-clockwise from +x.
struct ScannerModel {
  std::string name = "panoramic";
  double azimuth_span = 2 * kPi;          // rad, (0, 2 pi], centred on the scanner's +x
  double elevation_min = Radians(-60);    // rad, [-pi/2, pi/2)
  double elevation_max = Radians(90);     // rad, (elevation_min, pi/2]
  double azimuth_step = Radians(0.25);    // rad, native, > 0
  double elevation_step = Radians(0.25);  // rad, native, > 0
  double range_min = 0.5;                 // m, > 0; nearer is the scanner's own body
  double range_max = 20.0;                // m, > range_min
  double range_noise = 0.003;             // m, one sigma, independent of range
  double range_noise_ppm = 10.0;          // 1e-6 of the range, added to range_noise
  double max_incidence = Radians(75);     // rad, (0, pi/2); beyond it a sample has no value
  double clearance = 0.35;                // m, radius kept free around the scanner
  double positioning_error = 0.05;        // m per axis, by how much a person misses a position

  // Whether the heading of a scan makes no difference: the azimuths miss a turn by less than half a
  // step.
  bool TurnsAllAround() const { return azimuth_span > 2 * kPi - 0.5 * azimuth_step; }

  // One sigma of a range measurement, m.
  double RangeSigma(double range) const { return range_noise + 1e-6 * range_noise_ppm * range; }

  // rho(e) = 1 / (da de cos e), samples per steradian at elevation e (rad). Capped where the grid
  // only oversamples in azimuth: cos e is taken as at least the sine of one elevation step.
  double SamplesPerSteradian(double elevation) const;

  // s = rho(e) cos i / r^2, samples / m^2 (algorithm.md section 3); 0 where cos i <= 0.
  double SamplingDensity(double elevation, double cos_incidence, double range) const;
  // The same for an elevation given by its sine, for merging, which computes millions of densities.
  double SamplingDensityAtSine(double sin_elevation, double cos_incidence, double range) const;

  // The largest density this scanner reaches anywhere in its range: overhead cap, nearest, head on.
  double MaxSamplingDensity() const;

  // INVALID_ARGUMENT naming every field that is out of its range, in one message.
  absl::Status Validate() const;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCANNER_MODEL_H_
