#include "client/picture/canvas.h"

#include <cairo/cairo.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace vantage::picture {
namespace {

void SetColour(cairo_t* context, const Colour& c) {
  cairo_set_source_rgba(context, c.r, c.g, c.b, c.a);
}

// Cairo's ARGB32 holds native-endian words with colours multiplied by alpha.
uint32_t Premultiplied(const Colour& c) {
  const auto channel = [&](double v) { return static_cast<uint32_t>(std::lround(v * c.a * 255)); };
  return static_cast<uint32_t>(std::lround(c.a * 255)) << 24 | channel(c.r) << 16 |
         channel(c.g) << 8 | channel(c.b);
}

void SetFont(cairo_t* context, double size, bool bold) {
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, size);
}

}  // namespace

struct Canvas::Drawing {
  Drawing(int width, int height)
      : surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height)),
        context(cairo_create(surface)) {}
  ~Drawing() {
    cairo_destroy(context);
    cairo_surface_destroy(surface);
  }
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  cairo_surface_t* surface;  // owned
  cairo_t* context;          // owned
};

Canvas::Canvas(int width, int height, const Colour& background)
    : drawing_(std::make_unique<Drawing>(width, height)) {
  SetColour(drawing_->context, background);
  cairo_paint(drawing_->context);
}

Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas& Canvas::operator=(Canvas&&) noexcept = default;

int Canvas::width() const { return cairo_image_surface_get_width(drawing_->surface); }
int Canvas::height() const { return cairo_image_surface_get_height(drawing_->surface); }

void Canvas::Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double stroke,
                  const Colour& c) {
  cairo_t* context = drawing_->context;
  SetColour(context, c);
  cairo_set_line_width(context, stroke);
  cairo_move_to(context, from.x(), from.y());
  cairo_line_to(context, to.x(), to.y());
  cairo_stroke(context);
}

void Canvas::FillRectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max,
                           const Colour& c) {
  SetColour(drawing_->context, c);
  cairo_rectangle(drawing_->context, min.x(), min.y(), max.x() - min.x(), max.y() - min.y());
  cairo_fill(drawing_->context);
}

void Canvas::StrokeRectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max, double stroke,
                             const Colour& c) {
  SetColour(drawing_->context, c);
  cairo_set_line_width(drawing_->context, stroke);
  cairo_rectangle(drawing_->context, min.x(), min.y(), max.x() - min.x(), max.y() - min.y());
  cairo_stroke(drawing_->context);
}

void Canvas::FillCircle(const Eigen::Vector2d& centre, double radius, const Colour& c) {
  SetColour(drawing_->context, c);
  cairo_new_sub_path(drawing_->context);
  cairo_arc(drawing_->context, centre.x(), centre.y(), radius, 0, 2 * std::numbers::pi);
  cairo_fill(drawing_->context);
}

void Canvas::StrokeCircle(const Eigen::Vector2d& centre, double radius, double stroke,
                          const Colour& c, bool dashed) {
  cairo_t* context = drawing_->context;
  const double dashes[] = {5, 4};
  if (dashed) cairo_set_dash(context, dashes, 2, 0);
  SetColour(context, c);
  cairo_set_line_width(context, stroke);
  cairo_new_sub_path(context);
  cairo_arc(context, centre.x(), centre.y(), radius, 0, 2 * std::numbers::pi);
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
}

void Canvas::FillPolygon(const std::vector<Eigen::Vector2d>& points, const Colour& c) {
  if (points.empty()) return;
  SetColour(drawing_->context, c);
  cairo_move_to(drawing_->context, points[0].x(), points[0].y());
  for (size_t i = 1; i < points.size(); ++i) {
    cairo_line_to(drawing_->context, points[i].x(), points[i].y());
  }
  cairo_close_path(drawing_->context);
  cairo_fill(drawing_->context);
}

void Canvas::Text(const Eigen::Vector2d& at, const std::string& text, double size, const Colour& c,
                  Align align, bool bold) {
  const double width = align == Align::kLeft ? 0 : TextWidth(text, size, bold);
  const double shift = align == Align::kLeft ? 0 : align == Align::kCentre ? width / 2 : width;
  SetFont(drawing_->context, size, bold);
  SetColour(drawing_->context, c);
  cairo_move_to(drawing_->context, at.x() - shift, at.y());
  cairo_show_text(drawing_->context, text.c_str());
  cairo_new_path(drawing_->context);
}

std::vector<std::string> Wrapped(Canvas& canvas, const std::string& text, double size,
                                 double width) {
  std::vector<std::string> lines(1);
  for (const absl::string_view word : absl::StrSplit(text, ' ')) {
    std::string longer = absl::StrCat(lines.back(), lines.back().empty() ? "" : " ", word);
    if (!lines.back().empty() && canvas.TextWidth(longer, size) > width) {
      lines.emplace_back(word);
    } else {
      lines.back() = std::move(longer);
    }
  }
  return lines;
}

double Canvas::TextWidth(const std::string& text, double size, bool bold) {
  SetFont(drawing_->context, size, bold);
  cairo_text_extents_t extents;
  cairo_text_extents(drawing_->context, text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Image(const Eigen::Vector2d& min, const Eigen::Vector2d& max, const Raster& raster) {
  if (raster.width == 0 || raster.height == 0) return;
  cairo_surface_t* image =
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, raster.width, raster.height);
  cairo_surface_flush(image);
  unsigned char* data = cairo_image_surface_get_data(image);
  const int stride = cairo_image_surface_get_stride(image);
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      const uint32_t word = Premultiplied(raster.pixels[static_cast<size_t>(y) * raster.width + x]);
      std::memcpy(data + static_cast<ptrdiff_t>(y) * stride + x * 4, &word, 4);
    }
  }
  cairo_surface_mark_dirty(image);
  cairo_t* context = drawing_->context;
  cairo_save(context);
  cairo_translate(context, min.x(), min.y());
  cairo_scale(context, (max.x() - min.x()) / raster.width, (max.y() - min.y()) / raster.height);
  cairo_set_source_surface(context, image, 0, 0);
  cairo_pattern_set_filter(cairo_get_source(context), CAIRO_FILTER_NEAREST);
  cairo_paint(context);
  cairo_restore(context);
  cairo_surface_destroy(image);
}

void Canvas::Clip(const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  cairo_save(drawing_->context);
  cairo_rectangle(drawing_->context, min.x(), min.y(), max.x() - min.x(), max.y() - min.y());
  cairo_clip(drawing_->context);
}

void Canvas::Unclip() { cairo_restore(drawing_->context); }

Colour Canvas::PixelAt(int x, int y) const {
  cairo_surface_flush(drawing_->surface);
  const unsigned char* data = cairo_image_surface_get_data(drawing_->surface);
  uint32_t word = 0;
  std::memcpy(
      &word,
      data + static_cast<ptrdiff_t>(y) * cairo_image_surface_get_stride(drawing_->surface) + x * 4,
      4);
  return Rgb(word & 0xffffff);
}

absl::Status Canvas::WritePng(const std::string& path) const {
  cairo_surface_flush(drawing_->surface);
  errno = 0;
  const cairo_status_t status = cairo_surface_write_to_png(drawing_->surface, path.c_str());
  if (status == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
  return absl::ErrnoToStatus(
      errno != 0 ? errno : EIO,
      absl::StrCat("cannot write the picture ", path, ": ", cairo_status_to_string(status)));
}

}  // namespace vantage::picture
