// The real room scans from many priors: a table of what became of each.
#ifndef VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_
#define VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_

#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "tests/bench/calibration_pair.h"

namespace vantage::bench {

// The instrument (ranges quantised to 1 cm, columns skewed) and its reference pose, good to a few
// centimetres, allow no more than this, m.
inline constexpr double kRealAccuracy = 0.05;

// Both ways round, from `priors` random priors each up to 0.5 m and 15 degrees wrong. Empty, with
// a word on why, where the data are not.
std::vector<CalibrationPair> MeasureRealPairs(int priors, parallel::Parallel& parallel,
                                              std::string& why_not);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_
