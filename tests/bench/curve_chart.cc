#include "tests/bench/curve_chart.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::bench {
namespace {

constexpr double kWidth = 560;  // px, of a panel
constexpr double kHeight = 200;
constexpr double kLeft = 70;
constexpr double kTop = 40;
constexpr double kGap = 30;
constexpr double kLegend = 230;

void Text(double x, double y, const char* anchor, const std::string& text, std::string& out) {
  absl::StrAppendFormat(&out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>\n", x, y,
                        anchor, text);
}

std::string Number(double value) { return absl::StrFormat("%g", value); }

}  // namespace

bool WriteChart(const std::string& path, const std::string& title, double from, double to,
                const std::vector<ChartPanel>& panels) {
  const double height = kTop + static_cast<double>(panels.size()) * (kHeight + kGap) + 30;
  std::string out = absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
      "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"white\"/>\n",
      kLeft + kWidth + kLegend, height);
  Text(kLeft, 22, "start", title, out);
  const auto x_of = [&](double time) {
    return kLeft + kWidth * std::log(std::clamp(time, from, to) / from) / std::log(to / from);
  };
  double top = kTop;
  for (const ChartPanel& panel : panels) {
    const auto y_of = [&](double value) {
      const double share =
          panel.logarithmic ? std::log(std::clamp(value, panel.least, panel.most) / panel.least) /
                                  std::log(panel.most / panel.least)
                            : std::clamp(value / panel.most, 0.0, 1.0);
      return top + kHeight * (1 - share);
    };
    absl::StrAppendFormat(&out,
                          "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" fill=\"none\" "
                          "stroke=\"#888\"/>\n",
                          kLeft, top, kWidth, kHeight);
    Text(kLeft, top - 5, "start", panel.label, out);
    for (const double tick : panel.ticks) {
      absl::StrAppendFormat(&out,
                            "<line x1=\"%g\" x2=\"%g\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n",
                            kLeft, kLeft + kWidth, y_of(tick), y_of(tick));
      const bool lowest = panel.logarithmic && tick <= panel.least;
      Text(kLeft - 6, y_of(tick) + 4, "end", lowest ? "0" : Number(tick), out);
    }
    for (double decade = 1e-4; decade <= to; decade *= 10) {
      if (decade < from) continue;
      absl::StrAppendFormat(&out,
                            "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%g\" y2=\"%g\" stroke=\"#ddd\"/>\n",
                            x_of(decade), x_of(decade), top, top + kHeight);
      if (&panel == &panels.back()) {
        Text(x_of(decade), top + kHeight + 15, "middle", absl::StrCat(Number(decade), " s"), out);
      }
    }
    double legend = top + 10;
    for (const ChartCurve& curve : panel.curves) {
      const std::string style =
          absl::StrFormat("fill=\"none\" stroke=\"%s\" stroke-width=\"1.8\"%s", curve.colour,
                          curve.dashed ? " stroke-dasharray=\"5 3\"" : "");
      absl::StrAppend(&out, "<polyline ", style, " points=\"");
      for (const Eigen::Vector2d& p : curve.points) {
        absl::StrAppendFormat(&out, "%.1f,%.1f ", x_of(p.x()), y_of(p.y()));
      }
      absl::StrAppend(&out, "\"/>\n");
      absl::StrAppendFormat(&out, "<line x1=\"%g\" x2=\"%g\" y1=\"%g\" y2=\"%g\" %s/>\n",
                            kLeft + kWidth + 10, kLeft + kWidth + 34, legend, legend, style);
      Text(kLeft + kWidth + 40, legend + 4, "start", curve.name, out);
      legend += 17;
    }
    top += kHeight + kGap;
  }
  Text(kLeft + kWidth / 2, height - 8, "middle", "CPU time of one thread", out);
  absl::StrAppend(&out, "</svg>\n");
  std::ofstream file(path);
  file << out;
  return file.good();
}

}  // namespace vantage::bench
