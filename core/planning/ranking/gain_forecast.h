// What a scan will bring to the required density, of which the model tells only a part
// (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_GAIN_FORECAST_H_
#define VANTAGE_CORE_PLANNING_RANKING_GAIN_FORECAST_H_

namespace vantage::planning {

// The gain of a view by what it is made of, m2.
struct GainParts {
  double measured = 0;  // surface that was measured at less than its density
  double hidden = 0;    // false surface with little unknown space behind it
  double deep = 0;      // false surface with kDeep and more behind it
  double expected = 0;  // surface that is expected and not known, if it is as expected
};

// Of unknown space behind false surface, m: from here on it is a room and not the shadow of a
// thing. PlanningConfig::unknown_depth, 3 m by default, has to be as large; where it is less, no
// false surface is deep. The shadows of furniture and pillars of up to 1 m are shallower, rooms
// deeper; not tried in halls where what stands about is larger.
inline constexpr double kDeep = 2.5;

struct GainForecast {
  double expected = 0;  // m2, in the mean
  double lower = 0;     // m2: a scan brings less in one case of ten,
  double upper = 0;     // and more in one of ten
};

// A view that gains nothing by the model is expected to bring nothing.
GainForecast ForecastGain(const GainParts& parts);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_GAIN_FORECAST_H_
