#include "client/study/forecast_score.h"

#include <algorithm>
#include <cmath>

#include "client/study/median.h"

namespace vantage::study {
namespace {

// The constant-factor forecast that forecasts are held against: model gain with false surface
// twice, and expected surface. At least and at most so much of it comes in four cases of five of
// those that core/planning/ranking/gain_forecast was fitted to.
constexpr double kHiddenTwice = 2;
constexpr double kLeastOfIt = 0.57;
constexpr double kMostOfIt = 1.52;

constexpr double kNear = 0.25;  // of what was expected

// Of an interval that is to hold in four cases of five: its width, and ten times what it misses by.
// Less is better, and the true quantiles have least in the mean (Winkler 1972).
double WinklerScore(double lower, double upper, double came) {
  constexpr double kMissed = 2 / (1 - 0.8);
  return upper - lower + kMissed * (std::max(0.0, lower - came) + std::max(0.0, came - upper));
}

double ByAFactor(const study_records::v1::ScanRecord& scan) {
  const double measured = scan.forecast().by_kind().true_surface();
  const double hidden = scan.model_gain() - measured;
  return measured + kHiddenTwice * hidden + scan.forecast().expected_surface();
}

}  // namespace

ForecastScore ScoreForecasts(const std::vector<const study_records::v1::ScanRecord*>& scans) {
  ForecastScore score;
  std::vector<double> widths;
  double of_a_factor = 0;
  for (const study_records::v1::ScanRecord* scan : scans) {
    if (!scan->has_forecast() || !scan->has_brought() || scan->predicted() <= 0) continue;
    const double expected = scan->predicted();
    const double lower = scan->forecast().lower();
    const double upper = scan->forecast().upper();
    const double came = scan->brought();
    ++score.scans;
    score.expected += expected;
    if (lower <= came && came <= upper) score.held += expected;
    if (std::abs(came - expected) <= kNear * expected) score.near += expected;
    widths.push_back((upper - lower) / expected);
    score.winkler += WinklerScore(lower, upper, came);
    of_a_factor += WinklerScore(kLeastOfIt * ByAFactor(*scan), kMostOfIt * ByAFactor(*scan), came);
  }
  if (score.scans == 0) return score;
  score.held /= score.expected;
  score.near /= score.expected;
  score.width = Median(widths);
  score.winkler /= of_a_factor;
  return score;
}

}  // namespace vantage::study
