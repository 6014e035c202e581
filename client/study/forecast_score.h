// How well what was forecast of scans came.
#ifndef VANTAGE_CLIENT_STUDY_FORECAST_SCORE_H_
#define VANTAGE_CLIENT_STUDY_FORECAST_SCORE_H_

#include <vector>

#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

// Over scans that joined the model and had a forecast. Shares are by the area that was expected.
struct ForecastScore {
  int scans = 0;
  double expected = 0;  // m^2, their sum
  double held = 0;      // share of it that came within its interval
  double near = 0;      // share of it that came within a quarter of what was expected
  double width = 0;     // of the intervals, over what was expected; the median
  // Winkler's score of the intervals over that of a constant factor's: below 1 is better.
  double winkler = 0;
};

// Zero where no scan counts.
ForecastScore ScoreForecasts(const std::vector<const study_records::v1::ScanRecord*>& scans);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_FORECAST_SCORE_H_
