#include "core/cover/lower_bound.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace vantage::cover {
namespace {

constexpr int kIterations = 4000;
constexpr int kNoRise = 30;          // iterations without a rise, then steps are halved
constexpr double kLeastStep = 1e-3;  // of the first
constexpr double kInertia = 0.6;     // of the direction before
// Sums of some 10^5 numbers of about 1, each right to 1e-16: so much is not claimed.
constexpr double kRoundingOfBound = 1e-6;

// The relaxed problem at multipliers y (by element): minimise over x and z
//   sum of x (1 - what its elements' y sum to)  +  sum of z y,   weights of z at least the goal.
struct Relaxed {
  double value = 0;
  std::vector<double> direction;  // z minus how often x covers: by element
};

class Lagrangian {
 public:
  Lagrangian(const Instance& instance, int64_t goal)
      : instance_(instance), order_(instance.elements()) {
    std::iota(order_.begin(), order_.end(), 0);
    weights_.reserve(instance.elements());
    const double scale = 1 / static_cast<double>(std::max<int64_t>(goal, 1));
    for (const int64_t weight : instance.weights) {
      weights_.push_back(static_cast<double>(weight) * scale);
    }
  }

  // In parts of the goal.
  const std::vector<double>& weights() const { return weights_; }

  Relaxed At(const std::vector<double>& y, Meter& meter) {
    Relaxed relaxed;
    std::vector<double>& direction = relaxed.direction;
    direction.assign(y.size(), 0);
    for (size_t i = 0; i < instance_.candidates(); ++i) {
      double sum = 0;
      ForEach(instance_.covers[i], [&](size_t e) { sum += y[e]; });
      if (sum <= 1) continue;
      relaxed.value += 1 - sum;
      ForEach(instance_.covers[i], [&](size_t e) { direction[e] -= 1; });
    }
    // The elements that are cheapest for their weight make up the goal, the last one in part.
    std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
      const double of_a = y[a] * weights_[b];
      const double of_b = y[b] * weights_[a];
      return of_a != of_b ? of_a < of_b : a < b;
    });
    double missing = 1;
    for (const uint32_t e : order_) {
      if (missing <= 0 || weights_[e] <= 0) continue;
      const double share = std::min(1.0, missing / weights_[e]);
      relaxed.value += share * y[e];
      direction[e] += share;
      missing -= weights_[e];
    }
    meter.Add(instance_.covered_by.size() + 8 * y.size());
    return relaxed;
  }

 private:
  const Instance& instance_;
  std::vector<double> weights_;
  std::vector<uint32_t> order_;  // of elements, kept from one call to the next
};

}  // namespace

size_t LeastStations(const Instance& instance, int64_t goal, size_t enough, Meter& meter) {
  if (goal <= 0) return 0;
  Lagrangian lagrangian(instance, goal);
  // Feasible to begin with: each element pays by its weight, and nobody gets more than 1.
  std::vector<double> y = lagrangian.weights();
  double largest = 0;
  for (const ElementSet& set : instance.covers) {
    double sum = 0;
    ForEach(set, [&](size_t e) { sum += y[e]; });
    largest = std::max(largest, sum);
  }
  for (double& value : y) value /= largest;

  double best = 0;
  std::vector<double> best_y = y;
  std::vector<double> direction(y.size(), 0);
  double step = 1;
  int without_rise = 0;
  const auto rounded = [](double value) {
    return static_cast<size_t>(std::max(0.0, std::ceil(value - kRoundingOfBound)));
  };
  for (int i = 0; i < kIterations && step > kLeastStep && !meter.Over(); ++i) {
    const Relaxed at = lagrangian.At(y, meter);
    if (at.value > best) {
      if (at.value > best + 1e-4 * static_cast<double>(enough)) without_rise = 0;
      best = at.value;
      best_y = y;
      if (rounded(best) >= enough) break;
    }
    if (++without_rise > kNoRise) {
      step /= 2;
      without_rise = 0;
      y = best_y;
      std::fill(direction.begin(), direction.end(), 0);
      continue;
    }
    double square = 0;
    for (size_t e = 0; e < y.size(); ++e) {
      direction[e] = at.direction[e] + kInertia * direction[e];
      // What would lead below 0 leads nowhere.
      if (y[e] <= 0 && direction[e] < 0) direction[e] = 0;
      square += direction[e] * direction[e];
    }
    if (square <= 0) break;
    const double length = step * (static_cast<double>(enough) - at.value) / square;
    for (size_t e = 0; e < y.size(); ++e) y[e] = std::max(0.0, y[e] + length * direction[e]);
  }
  return rounded(best);
}

}  // namespace vantage::cover
