#include "tests/bench/shared_error.h"

#include <cmath>

#include "core/sensor/scanner_model.h"

namespace vantage::bench {

SharedError::SharedError(double correlation_length, uint64_t seed) {
  Normal normal(seed);
  simulation::RandomSequence random(simulation::MixBits(seed) + 1);
  const double scale = correlation_length / std::sqrt(2 * sensor::kPi);
  for (Wave& wave : waves_) {
    wave.vector = (normal.Three() / scale).cast<float>();
    wave.phase = static_cast<float>(random.Between(0, 2 * sensor::kPi));
  }
}

double SharedError::At(const Eigen::Vector3f& point) const {
  float sum = 0;
  for (const Wave& wave : waves_) sum += std::cos(wave.vector.dot(point) + wave.phase);
  return std::sqrt(2.0 / kWaves) * sum;
}

void AddSharedError(const Eigen::Isometry3d& pose, double sigma, double correlation_length,
                    uint64_t seed, sensor::RangeImage& image) {
  const SharedError shared(correlation_length, simulation::MixBits(seed));
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      float& range = image.range[image.Index(column, row)];
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d point = pose * Eigen::Vector3d(range * image.Direction(column, row));
      range += static_cast<float>(sigma * shared.At(point.cast<float>()));
    }
  }
}

}  // namespace vantage::bench
