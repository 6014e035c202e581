// The report of a calibration study: figures, a table by family, and a chart of predicted and
// achieved errors.
#ifndef VANTAGE_TESTS_BENCH_CALIBRATION_REPORT_H_
#define VANTAGE_TESTS_BENCH_CALIBRATION_REPORT_H_

#include <string>
#include <vector>

#include "tests/bench/calibration_pair.h"
#include "tests/bench/figures.h"

namespace vantage::bench {

// The one-sided 95 % lower limit of a share seen as `good` of `all` (Clopper and Pearson).
double LowerLimit95(size_t good, size_t all);

// predict.* and verdict.* of all pairs.
void ReportCalibration(const std::vector<CalibrationPair>& pairs,
                       const registration::RegistrationConfig& config, Figures& figures);
void PrintFamilies(const std::vector<CalibrationPair>& pairs,
                   const registration::RegistrationConfig& config);
// Of how many pairs it was said that the instrument cannot do what is required, and after how many
// in a scene.
void PrintInstrument(const std::vector<CalibrationPair>& pairs);
// One line each.
void PrintRealPairs(const std::vector<CalibrationPair>& pairs);

// Predicted E and that of the alignment against what was achieved, both axes logarithmic. False
// when the file cannot be written.
bool DrawCalibration(const std::string& path, const std::vector<CalibrationPair>& pairs,
                     const registration::RegistrationConfig& config);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CALIBRATION_REPORT_H_
