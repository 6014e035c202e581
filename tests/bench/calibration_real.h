// Aligns the real room scans from many priors and tabulates the results.
#ifndef VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_
#define VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_

#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "tests/bench/calibration_pair.h"

namespace vantage::bench {

// The accuracy that can be shown with this instrument (ranges quantised to 1 cm, columns skewed)
// and its reference pose (good to a few centimetres), m.
inline constexpr double kRealAccuracy = 0.05;

// Aligns each scan to the other from `priors` random priors, up to 0.5 m and 15 degrees wrong. When
// the data are missing, the table is empty and says so.
std::vector<CalibrationPair> MeasureRealPairs(int priors, parallel::Parallel& parallel,
                                              std::string& why_not);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CALIBRATION_REAL_H_
