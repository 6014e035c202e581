// Drawings as SVG, to stand inside an HTML page.
#ifndef VANTAGE_CLIENT_STUDY_SVG_H_
#define VANTAGE_CLIENT_STUDY_SVG_H_

#include <Eigen/Core>
#include <string>
#include <vector>

namespace vantage::study {

// Text with everything that HTML would take for markup replaced.
std::string Escape(const std::string& text);

// Coordinates in pixels, y down.
class Svg {
 public:
  Svg(double width, double height) : width_(width), height_(height) {}

  void Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::string& colour,
            double width);
  void Polyline(const std::vector<Eigen::Vector2d>& points, const std::string& colour, double width,
                const std::string& dashes = "");
  void Circle(const Eigen::Vector2d& centre, double radius, const std::string& fill,
              const std::string& stroke);
  // `anchor`: start, middle or end.
  void Text(const Eigen::Vector2d& at, const std::string& text, double size,
            const std::string& colour, const std::string& anchor);
  // Many lines in one element.
  void Segments(const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& segments,
                const std::string& colour, double width);

  // The whole element.
  std::string Finish(const std::string& title) const;

 private:
  double width_;
  double height_;
  std::string body_;
};

struct Curve {
  std::string name;
  std::string colour;
  bool dashed = false;
  std::vector<Eigen::Vector2d> points;  // in the chart's units, x rising
};

// Curves over [x_from, x_to] x [0, 1], with a dotted line at `goal` and a legend.
std::string Chart(const std::string& title, const std::string& x_label, double x_from, double x_to,
                  double goal, const std::vector<Curve>& curves);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_SVG_H_
