// Random numbers that depend only on their purpose, not on the order in which they are drawn.
#ifndef VANTAGE_CORE_SIMULATION_RANDOM_SEQUENCE_H_
#define VANTAGE_CORE_SIMULATION_RANDOM_SEQUENCE_H_

#include <cmath>
#include <cstdint>
#include <numbers>

namespace vantage::simulation {

// The finaliser of SplitMix64: every bit of the input moves half of the bits of the output.
constexpr uint64_t MixBits(uint64_t x) {
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

// Draw `stream` for item `index` under `seed`.
constexpr uint64_t RandomBits(uint64_t seed, uint64_t index, uint64_t stream) {
  return MixBits(MixBits(MixBits(seed) ^ index) + stream);
}

// Uniform in [0, 1).
constexpr double RandomUniform(uint64_t seed, uint64_t index, uint64_t stream) {
  return static_cast<double>(RandomBits(seed, index, stream) >> 11) * 0x1p-53;
}

// Standard normal, by Box and Muller; uses streams `stream` and `stream` + 1.
inline double RandomNormal(uint64_t seed, uint64_t index, uint64_t stream) {
  const double u = 1.0 - RandomUniform(seed, index, stream);  // (0, 1]
  const double v = RandomUniform(seed, index, stream + 1);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

// A sequence of draws, for work that has an order.
class RandomSequence {
 public:
  explicit RandomSequence(uint64_t seed) : seed_(MixBits(seed)) {}
  uint64_t Bits() { return RandomBits(seed_, next_++, 0); }
  double Uniform() { return static_cast<double>(Bits() >> 11) * 0x1p-53; }
  double Between(double low, double high) { return low + (high - low) * Uniform(); }
  // In [0, count).
  uint64_t Below(uint64_t count) { return static_cast<uint64_t>(Uniform() * double(count)); }
  bool Chance(double probability) { return Uniform() < probability; }

 private:
  uint64_t seed_;
  uint64_t next_ = 0;
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_RANDOM_SEQUENCE_H_
