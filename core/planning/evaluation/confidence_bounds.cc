#include "core/planning/evaluation/confidence_bounds.h"

#include <algorithm>
#include <cmath>

namespace vantage::planning {
namespace {

constexpr double kUnknown = -1;
constexpr int kBisections = 20;  // to 1e-6, outwards

// Relative entropy of Bernoulli(p) to Bernoulli(q), nats.
double RelativeEntropy(double p, double q) {
  double sum = 0;
  if (p > 0) sum += p * std::log(p / q);
  if (p < 1) sum += (1 - p) * std::log((1 - p) / (1 - q));
  return sum;
}

// The mean beyond `p`, towards `out`, from which on the relative entropy exceeds `limit`. Bisection
// keeps `out` on the far side of the limit and `in` on the near one.
double Invert(double p, double limit, double out) {
  double in = p;
  for (int k = 0; k < kBisections && p != out; ++k) {
    const double q = (in + out) / 2;
    (RelativeEntropy(p, q) > limit ? out : in) = q;
  }
  return out;
}

uint64_t Mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

MeanBounds::MeanBounds(uint64_t draws, double log_inverse_error)
    : limit_(log_inverse_error / static_cast<double>(draws)),
      lower_(kSteps + 1, kUnknown),
      upper_(kSteps + 1, kUnknown) {}

double MeanBounds::Lower(double average) {
  const int i = std::clamp(static_cast<int>(std::floor(average * kSteps)), 0, kSteps);
  double& bound = lower_[static_cast<size_t>(i)];
  if (bound == kUnknown) bound = Invert(static_cast<double>(i) / kSteps, limit_, 0);
  return bound;
}

double MeanBounds::Upper(double average) {
  const int i = std::clamp(static_cast<int>(std::ceil(average * kSteps)), 0, kSteps);
  double& bound = upper_[static_cast<size_t>(i)];
  if (bound == kUnknown) bound = Invert(static_cast<double>(i) / kSteps, limit_, 1);
  return bound;
}

double LowerMeanBound(uint64_t draws, double log_inverse_error, double average) {
  return Invert(average, log_inverse_error / static_cast<double>(draws), 0);
}

double UpperMeanBound(uint64_t draws, double log_inverse_error, double average) {
  return Invert(average, log_inverse_error / static_cast<double>(draws), 1);
}

bool RulesOutMean(uint64_t draws, double log_inverse_error, double average, double mean) {
  return static_cast<double>(draws) * RelativeEntropy(average, mean) > log_inverse_error;
}

double HashToUnit(uint64_t seed, uint64_t round, uint64_t index) {
  return static_cast<double>(Mix(Mix(Mix(seed) ^ round) ^ index) >> 11) * 0x1.0p-53;
}

}  // namespace vantage::planning
