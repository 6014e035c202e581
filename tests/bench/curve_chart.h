// Curves over time as an SVG file.
#ifndef VANTAGE_TESTS_BENCH_CURVE_CHART_H_
#define VANTAGE_TESTS_BENCH_CURVE_CHART_H_

#include <Eigen/Core>
#include <string>
#include <vector>

namespace vantage::bench {

struct ChartCurve {
  std::string name;
  std::string colour;
  bool dashed = false;
  std::vector<Eigen::Vector2d> points;  // time (s, > 0), value
};

// One above the other, time on a common logarithmic axis.
struct ChartPanel {
  std::string label;
  // Logarithmic: values below `least` are drawn there, as 0 is. Otherwise from 0 to `most`.
  bool logarithmic = false;
  double least = 0;
  double most = 1;
  std::vector<double> ticks;
  std::vector<ChartCurve> curves;
};

// False when the file cannot be written.
bool WriteChart(const std::string& path, const std::string& title, double from, double to,
                const std::vector<ChartPanel>& panels);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CURVE_CHART_H_
