// Drawing in pixels: the few operations that the pictures need, and PNG output. Only this file uses
// the drawing library.
#ifndef VANTAGE_CLIENT_PICTURE_CANVAS_H_
#define VANTAGE_CLIENT_PICTURE_CANVAS_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/picture/palette.h"

namespace vantage::picture {

// Rows from top to bottom, four bytes a pixel.
struct Raster {
  int width = 0;
  int height = 0;
  std::vector<Colour> pixels;  // row after row; a == 0 leaves what is below

  Raster(int w, int h) : width(w), height(h), pixels(static_cast<size_t>(w) * h, {0, 0, 0, 0}) {}
  Colour& At(int x, int y) { return pixels[static_cast<size_t>(y) * width + x]; }
};

enum class Align { kLeft, kCentre, kRight };

// Origin top left, x right, y down, unit one pixel.
class Canvas {
 public:
  Canvas(int width, int height, const Colour& background);
  ~Canvas();
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) noexcept;

  int width() const;
  int height() const;

  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double stroke, const Colour& c);
  void FillRectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max, const Colour& c);
  void StrokeRectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max, double stroke,
                       const Colour& c);
  void FillCircle(const Eigen::Vector2d& centre, double radius, const Colour& c);
  void StrokeCircle(const Eigen::Vector2d& centre, double radius, double stroke, const Colour& c,
                    bool dashed = false);
  void FillPolygon(const std::vector<Eigen::Vector2d>& points, const Colour& c);

  // `at` is on the baseline. Size in pixels.
  void Text(const Eigen::Vector2d& at, const std::string& text, double size, const Colour& c,
            Align align = Align::kLeft, bool bold = false);
  double TextWidth(const std::string& text, double size, bool bold = false);

  // Stretches the raster over the rectangle without smoothing: its cells stay cells.
  void Image(const Eigen::Vector2d& min, const Eigen::Vector2d& max, const Raster& raster);

  // Nothing is drawn outside the rectangle until Unclip.
  void Clip(const Eigen::Vector2d& min, const Eigen::Vector2d& max);
  void Unclip();

  // The colour of a pixel.
  Colour PixelAt(int x, int y) const;

  // NOT_FOUND, PERMISSION_DENIED, RESOURCE_EXHAUSTED as the file system says; names the path.
  absl::Status WritePng(const std::string& path) const;

 private:
  struct Drawing;
  std::unique_ptr<Drawing> drawing_;
};

// `text` in lines of at most `width` pixels, broken at spaces.
std::vector<std::string> Wrapped(Canvas& canvas, const std::string& text, double size,
                                 double width);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_CANVAS_H_
