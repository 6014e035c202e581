#include "client/study/svg.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

namespace vantage::study {
namespace {

using Eigen::Vector2d;

constexpr double kWidth = 620;
constexpr double kHeight = 340;
constexpr double kLeft = 44;
constexpr double kRight = 150;  // for the legend
constexpr double kTop = 26;
constexpr double kBottom = 40;

// A step of 1, 2 or 5 times a power of ten that divides `span` into at most `most` parts.
double NiceStep(double span, int most) {
  const double least = std::max(span, 1e-9) / most;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

}  // namespace

std::string Escape(const std::string& text) {
  return absl::StrReplaceAll(
      text, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}, {"'", "&#39;"}});
}

void Svg::Line(const Vector2d& a, const Vector2d& b, const std::string& colour, double width) {
  absl::StrAppendFormat(
      &body_, "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='%s' stroke-width='%.1f'/>\n",
      a.x(), a.y(), b.x(), b.y(), colour, width);
}

void Svg::Polyline(const std::vector<Vector2d>& points, const std::string& colour, double width,
                   const std::string& dashes) {
  body_ += "<polyline fill='none' points='";
  for (const Vector2d& p : points) absl::StrAppendFormat(&body_, "%.1f,%.1f ", p.x(), p.y());
  absl::StrAppendFormat(&body_, "' stroke='%s' stroke-width='%.1f'", colour, width);
  if (!dashes.empty()) absl::StrAppend(&body_, " stroke-dasharray='", dashes, "'");
  body_ += "/>\n";
}

void Svg::Circle(const Vector2d& centre, double radius, const std::string& fill,
                 const std::string& stroke) {
  absl::StrAppendFormat(&body_, "<circle cx='%.1f' cy='%.1f' r='%.1f' fill='%s' stroke='%s'/>\n",
                        centre.x(), centre.y(), radius, fill, stroke);
}

void Svg::Text(const Vector2d& at, const std::string& text, double size, const std::string& colour,
               const std::string& anchor) {
  absl::StrAppendFormat(
      &body_, "<text x='%.1f' y='%.1f' font-size='%.0f' fill='%s' text-anchor='%s'>%s</text>\n",
      at.x(), at.y(), size, colour, anchor, Escape(text));
}

void Svg::Segments(const std::vector<std::pair<Vector2d, Vector2d>>& segments,
                   const std::string& colour, double width) {
  body_ += "<path d='";
  for (const auto& [a, b] : segments) {
    absl::StrAppendFormat(&body_, "M%.1f %.1fL%.1f %.1f", a.x(), a.y(), b.x(), b.y());
  }
  absl::StrAppendFormat(&body_, "' stroke='%s' stroke-width='%.1f' fill='none'/>\n", colour, width);
}

std::string Svg::Finish(const std::string& title) const {
  return absl::StrFormat(
      "<svg xmlns='http://www.w3.org/2000/svg' role='img' width='%.0f' height='%.0f' viewBox='0 0 "
      "%.0f %.0f'>\n<title>%s</title>\n%s</svg>\n",
      width_, height_, width_, height_, Escape(title), body_);
}

std::string Chart(const std::string& title, const std::string& x_label, double x_from, double x_to,
                  double goal, const std::vector<Curve>& curves) {
  Svg svg(kWidth, kHeight);
  const double x_span = std::max(x_to - x_from, 1e-9);
  const auto place = [&](double x, double y) {
    return Vector2d(kLeft + (kWidth - kLeft - kRight) * (x - x_from) / x_span,
                    kHeight - kBottom - (kHeight - kTop - kBottom) * y);
  };
  svg.Text({kLeft, 16}, title, 13, "#222", "start");
  for (int percent = 0; percent <= 100; percent += 20) {
    const double y = percent / 100.0;
    svg.Line(place(x_from, y), place(x_to, y), "#e4e4e4", 1);
    svg.Text(place(x_from, y) + Vector2d(-6, 4), absl::StrCat(percent, " %"), 11, "#555", "end");
  }
  const double step = NiceStep(x_span, 12);
  for (double x = std::ceil(x_from / step) * step; x <= x_to + 1e-9; x += step) {
    svg.Line(place(x, 0), place(x, 0) + Vector2d(0, 4), "#888", 1);
    svg.Text(place(x, 0) + Vector2d(0, 17), absl::StrFormat("%g", x), 11, "#555", "middle");
  }
  svg.Text(place(0.5 * (x_from + x_to), 0) + Vector2d(0, 33), x_label, 12, "#333", "middle");
  svg.Polyline({place(x_from, goal), place(x_to, goal)}, "#888", 1, "2 3");
  double legend = kTop + 6;
  for (const Curve& curve : curves) {
    std::vector<Vector2d> points;
    for (const Vector2d& p : curve.points) {
      if (p.x() <= x_to + 1e-9) points.push_back(place(p.x(), std::clamp(p.y(), 0.0, 1.0)));
    }
    const std::string dashes = curve.dashed ? "6 3" : "";
    svg.Polyline(points, curve.colour, 2, dashes);
    const double x = kWidth - kRight + 12;
    svg.Polyline({{x, legend}, {x + 22, legend}}, curve.colour, 2, dashes);
    svg.Text({x + 28, legend + 4}, curve.name, 12, "#222", "start");
    legend += 17;
  }
  return svg.Finish(title);
}

}  // namespace vantage::study
