// Bounds on a mean from a sample, without assuming a distribution (algorithm.md section 8, 'Bounds
// and the gap').
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_CONFIDENCE_BOUNDS_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_CONFIDENCE_BOUNDS_H_

#include <cstdint>
#include <vector>

namespace vantage::planning {

// Hoeffding's first theorem (1963): for n independent draws from [0, 1], not necessarily alike,
// whose means average to mu, P(average >= mu + t) <= exp(-n KL(mu + t || mu)), and likewise below.
// Inverting it bounds mu from the observed average. Bounds are computed on a grid of averages and
// kept, since thousands of views ask for a few hundred of them; an average is rounded to the grid
// so that its bounds only get wider.
class MeanBounds {
 public:
  // Each side fails with a probability of at most exp(-log_inverse_error).
  MeanBounds(uint64_t draws, double log_inverse_error);

  double Lower(double average);  // [0, average]
  double Upper(double average);  // [average, 1]

 private:
  static constexpr int kSteps = 1024;

  double limit_;
  std::vector<double> lower_;  // for the average i / kSteps; kUnknown: not computed yet
  std::vector<double> upper_;
};

// The same for one average, not rounded: where means of a thousandth have to be told apart.
double LowerMeanBound(uint64_t draws, double log_inverse_error, double average);
double UpperMeanBound(uint64_t draws, double log_inverse_error, double average);
// True when LowerMeanBound() is above or UpperMeanBound() is below `mean`, which takes less time to
// find out than the bounds.
bool RulesOutMean(uint64_t draws, double log_inverse_error, double average, double mean);

// A pseudo-random number in [0, 1) that depends only on its arguments (SplitMix64).
double HashToUnit(uint64_t seed, uint64_t round, uint64_t index);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_CONFIDENCE_BOUNDS_H_
