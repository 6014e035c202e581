#include "client/picture/map_panel.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace vantage::picture {
namespace {

using Eigen::Vector2d;

constexpr double kStationRadius = 12;

}  // namespace

void MapPanel::Title(const std::string& text) {
  canvas_.Text({min().x(), min().y() - 12}, text, 19, palette::kInk, Align::kLeft, true);
}

double MapPanel::RoundStep() const {
  for (const double step : {1.0, 2.0, 5.0, 10.0, 20.0}) {
    if (step * scale_ >= 45) return step;
  }
  return 50.0;
}

void MapPanel::Grid() {
  const double step = RoundStep();
  for (double x = std::ceil(bounds_.min().x() / step) * step; x <= bounds_.max().x(); x += step) {
    const double px = ToPixels({x, 0}).x();
    canvas_.Line({px, min().y()}, {px, max().y()}, 1, palette::kGrid);
    canvas_.Text({px, max().y() + 16}, absl::StrCat(std::lround(x)), 12, palette::kFaintInk,
                 Align::kCentre);
  }
  for (double y = std::ceil(bounds_.min().y() / step) * step; y <= bounds_.max().y(); y += step) {
    const double py = ToPixels({0, y}).y();
    canvas_.Line({min().x(), py}, {max().x(), py}, 1, palette::kGrid);
    canvas_.Text({min().x() - 6, py + 4}, absl::StrCat(std::lround(y)), 12, palette::kFaintInk,
                 Align::kRight);
  }
  canvas_.Text({max().x(), max().y() + 32}, "x, m (model frame)", 12, palette::kFaintInk,
               Align::kRight);
  canvas_.Text({min().x() - 6, min().y() - 2}, "y, m", 12, palette::kFaintInk, Align::kRight);
}

void MapPanel::ScaleBar() {
  const double length = RoundStep() * 2;
  const double pixels = length * scale_;
  const Vector2d left = {min().x(), max().y() + 32};
  canvas_.FillRectangle(left - Vector2d(0, 6), left + Vector2d(pixels / 2, 0), palette::kInk);
  canvas_.StrokeRectangle(left - Vector2d(0, 6), left + Vector2d(pixels, 0), 1.2, palette::kInk);
  canvas_.Text(left + Vector2d(pixels + 6, 1), absl::StrCat(std::lround(length), " m"), 12,
               palette::kInk);
}

void MapPanel::Frame() { canvas_.StrokeRectangle(min(), max(), 1, palette::kFaintInk); }

void MapPanel::Image(const Vector2d& origin, double cell, const Raster& raster) {
  const Vector2d size(raster.width * cell, raster.height * cell);
  canvas_.Clip(min(), max());
  canvas_.Image(ToPixels(origin + Vector2d(0, size.y())), ToPixels(origin + Vector2d(size.x(), 0)),
                raster);
  canvas_.Unclip();
}

void MapPanel::Station(const Vector2d& at, int number, bool merged, const Colour& colour) {
  const Vector2d p = ToPixels(at);
  canvas_.FillCircle(p, kStationRadius + 2, palette::kWhite);
  if (merged) {
    canvas_.FillCircle(p, kStationRadius, colour);
  } else {
    canvas_.StrokeCircle(p, kStationRadius - 1, 2, colour, true);
  }
  canvas_.Text(p + Vector2d(0, 5), absl::StrCat(number), 14, merged ? palette::kWhite : colour,
               Align::kCentre, true);
}

void MapPanel::Way(const std::vector<Vector2d>& points, const Colour& colour) {
  for (const auto& [stroke, drawn] : {std::pair{5.5, palette::kWhite.Alpha(0.8)}, {3.0, colour}}) {
    for (size_t i = 1; i < points.size(); ++i) {
      canvas_.Line(ToPixels(points[i - 1]), ToPixels(points[i]), stroke, drawn);
    }
  }
}

void MapPanel::Next(const Vector2d& at, double separation) {
  const Vector2d p = ToPixels(at);
  canvas_.StrokeCircle(p, separation * scale_, 3.5, palette::kWhite.Alpha(0.8));
  canvas_.StrokeCircle(p, separation * scale_, 1.8, palette::kNextPosition, true);
  canvas_.FillCircle(p, kStationRadius + 4, palette::kWhite);
  canvas_.StrokeCircle(p, kStationRadius + 1, 4, palette::kNextPosition);
  const double arm = kStationRadius + 9;
  for (const Vector2d& d : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1)}) {
    canvas_.Line(p + d * 5, p + d * arm, 3, palette::kNextPosition);
  }
}

void MapPanel::Candidate(const Vector2d& at, int rank) {
  const Vector2d p = ToPixels(at);
  const double r = 12;
  const auto diamond = [&](double size) {
    return std::vector<Vector2d>{p + Vector2d(0, -size), p + Vector2d(size, 0),
                                 p + Vector2d(0, size), p + Vector2d(-size, 0)};
  };
  canvas_.FillPolygon(diamond(r + 2.5), palette::kInk);
  canvas_.FillPolygon(diamond(r), palette::kWhite);
  canvas_.Text(p + Vector2d(0, 4), absl::StrCat(rank), 11, palette::kInk, Align::kCentre, true);
}

void MapPanel::Refused(const Vector2d& at) {
  const Vector2d p = ToPixels(at);
  for (const auto& [stroke, colour] :
       {std::pair{5.0, palette::kWhite}, std::pair{2.5, palette::kInk}}) {
    canvas_.Line(p + Vector2d(-6, -6), p + Vector2d(6, 6), stroke, colour);
    canvas_.Line(p + Vector2d(-6, 6), p + Vector2d(6, -6), stroke, colour);
  }
}

void MapPanel::Region(const Eigen::AlignedBox2d& box) {
  const Vector2d low = ToPixels({box.min().x(), box.max().y()});
  const Vector2d high = ToPixels({box.max().x(), box.min().y()});
  canvas_.FillRectangle(low, high, palette::kNextPosition.Alpha(0.25));
  canvas_.StrokeRectangle(low, high, 1.5, palette::kNextPosition);
}

}  // namespace vantage::picture
