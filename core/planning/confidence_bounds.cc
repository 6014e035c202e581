#include "core/planning/confidence_bounds.h"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

// Relative entropy of Bernoulli(p) to Bernoulli(q), nats.
double RelativeEntropy(double p, double q) {
  double sum = 0;
  if (p > 0) sum += p * std::log(p / q);
  if (p < 1) sum += (1 - p) * std::log((1 - p) / (1 - q));
  return sum;
}

uint64_t Mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

MeanBounds::MeanBounds(uint64_t draws, double log_inverse_error)
    : lower_(kSteps + 1), upper_(kSteps + 1) {
  const double limit = log_inverse_error / static_cast<double>(draws);
  for (int i = 0; i <= kSteps; ++i) {
    const double p = static_cast<double>(i) / kSteps;
    // Bisection keeps `out` on the far side of the limit and `in` on the near one.
    double in = p;
    double out = 1;
    for (int k = 0; k < 40 && p < 1; ++k) {
      const double q = (in + out) / 2;
      (RelativeEntropy(p, q) > limit ? out : in) = q;
    }
    upper_[static_cast<size_t>(i)] = out;
    in = p;
    out = 0;
    for (int k = 0; k < 40 && p > 0; ++k) {
      const double q = (in + out) / 2;
      (RelativeEntropy(p, q) > limit ? out : in) = q;
    }
    lower_[static_cast<size_t>(i)] = out;
  }
}

double MeanBounds::Lower(double average) const {
  const int i = std::clamp(static_cast<int>(std::floor(average * kSteps)), 0, kSteps);
  return lower_[static_cast<size_t>(i)];
}

double MeanBounds::Upper(double average) const {
  const int i = std::clamp(static_cast<int>(std::ceil(average * kSteps)), 0, kSteps);
  return upper_[static_cast<size_t>(i)];
}

double HashToUnit(uint64_t seed, uint64_t round, uint64_t index) {
  return static_cast<double>(Mix(Mix(Mix(seed) ^ round) ^ index) >> 11) * 0x1.0p-53;
}

}  // namespace vantage
