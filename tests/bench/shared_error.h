// Errors of ranges that neighbours share, beside a scanner's white noise.
#ifndef VANTAGE_TESTS_BENCH_SHARED_ERROR_H_
#define VANTAGE_TESTS_BENCH_SHARED_ERROR_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/sensor/range_image.h"

namespace vantage::bench {

// A smooth random function of the place, of unit variance, whose integral over a plane is that of
// squares of the correlation length (m): a squared exponential by random cosines.
class SharedError {
 public:
  SharedError(double correlation_length, uint64_t seed);
  double At(const Eigen::Vector3f& point) const;
  // Adds it, `sigma` m at one, to the ranges of a scan made at `pose` (scanner to world frame).
  void AddTo(sensor::RangeImage& image, const Eigen::Isometry3d& pose, double sigma) const;

 private:
  static constexpr size_t kWaves = 32;
  struct Wave {
    Eigen::Vector3f vector;
    float phase;
  };
  std::array<Wave, kWaves> waves_;
};

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_SHARED_ERROR_H_
