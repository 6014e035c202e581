// Errors of ranges that neighbours share: what averaging does not take away.
#ifndef VANTAGE_TESTS_BENCH_SHARED_ERROR_H_
#define VANTAGE_TESTS_BENCH_SHARED_ERROR_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/sensor/range_image.h"
#include "core/simulation/random_sequence.h"

namespace vantage::bench {

// Draws one after the other.
class Normal {
 public:
  explicit Normal(uint64_t seed) : seed_(seed) {}
  double operator()() { return simulation::RandomNormal(seed_, next_++, 0); }
  Eigen::Vector3d Three() {
    const double x = (*this)();
    const double y = (*this)();
    return {x, y, (*this)()};
  }

 private:
  uint64_t seed_;
  uint64_t next_ = 0;
};

// A smooth random function of the place, of unit variance, whose integral over a plane is that of
// squares of the correlation length: a squared exponential by random cosines.
class SharedError {
 public:
  SharedError(double correlation_length, uint64_t seed);
  double At(const Eigen::Vector3f& point) const;

 private:
  static constexpr size_t kWaves = 32;
  struct Wave {
    Eigen::Vector3f vector;
    float phase;
  };
  std::array<Wave, kWaves> waves_;
};

// Adds such a function of the place where each ray ended, times `sigma` (m), to a scan's ranges.
// `pose` is the one that the scan was made at.
void AddSharedError(const Eigen::Isometry3d& pose, double sigma, double correlation_length,
                    uint64_t seed, sensor::RangeImage& image);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_SHARED_ERROR_H_
