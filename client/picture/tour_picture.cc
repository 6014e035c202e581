#include "client/picture/tour_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "client/picture/column_raster.h"
#include "client/picture/map_panel.h"

namespace vantage::picture {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;

constexpr double kMargin = 56;        // pixels
constexpr double kMaxWidth = 1800;    // of the map
constexpr double kMaxHeight = 1100;   // of the map
constexpr double kLeastWidth = 1000;  // the width of title and figures
constexpr double kPanelTitle = 40;
constexpr double kPanelFoot = 62;
constexpr double kLine = 28;  // of the legend

AlignedBox2d MapBounds(const TourPicture& picture, const ColumnMap& columns) {
  AlignedBox2d bounds;
  if (columns.width() > 0) bounds = columns.bounds();
  for (const auto& tour : picture.tours) {
    for (const auto& stop : tour.stops) bounds.extend(stop.position);
  }
  if (bounds.isEmpty()) bounds = AlignedBox2d(Vector2d(-1, -1), Vector2d(1, 1));
  const Vector2d margin(0.3, 0.3);
  return {bounds.min() - margin, bounds.max() + margin};
}

void DrawTours(MapPanel& panel, const TourPicture& picture) {
  // Ways are drawn first, so that none crosses a station's mark.
  for (size_t i = 0; i < picture.tours.size(); ++i) {
    for (const auto& stop : picture.tours[i].stops)
      panel.Way(stop.way, Distinct(static_cast<int>(i)));
  }
  for (size_t i = 0; i < picture.tours.size(); ++i) {
    int number = 0;
    for (const auto& stop : picture.tours[i].stops) {
      panel.Station(stop.position, ++number, stop.merged, Distinct(static_cast<int>(i)));
    }
  }
}

}  // namespace

Canvas DrawTourPicture(const TourPicture& picture) {
  const ColumnMap columns(picture.surfaces, picture.voxel_size, picture.required_density);
  const AlignedBox2d bounds = MapBounds(picture, columns);
  const Vector2d size = bounds.sizes();
  const double scale = std::min(kMaxWidth / size.x(), kMaxHeight / size.y());
  const double top = 62 + 24 * static_cast<double>(picture.figures.size()) + kPanelTitle;
  const double foot = top + size.y() * scale + kPanelFoot;
  const double width = std::max(kLeastWidth, size.x() * scale + 2 * kMargin);
  const double height = foot + kLine * static_cast<double>(picture.tours.size()) + 16;

  Canvas canvas(static_cast<int>(width), static_cast<int>(std::ceil(height)), palette::kWhite);
  canvas.Text({kMargin, 44}, picture.title, 27, palette::kInk, Align::kLeft, true);
  double y = 72;
  for (const std::string& line : picture.figures) {
    canvas.Text({kMargin, y}, line, 17, palette::kInk);
    y += 24;
  }
  MapPanel panel(canvas, {kMargin, top}, bounds, scale);
  panel.Title("Tours over the walls that were measured, stations in each scanner's order");
  panel.Grid();
  if (columns.width() > 0) panel.Image(columns.origin(), columns.cell(), ContextRaster(columns));
  DrawTours(panel, picture);
  panel.ScaleBar();
  panel.Frame();
  y = foot;
  for (size_t i = 0; i < picture.tours.size(); ++i) {
    canvas.FillRectangle({kMargin, y - 12}, {kMargin + 36, y}, Distinct(static_cast<int>(i)));
    canvas.Text({kMargin + 48, y}, picture.tours[i].label, 16, palette::kInk);
    y += kLine;
  }
  return canvas;
}

absl::Status WriteTourPicture(const TourPicture& picture, const std::string& path) {
  return DrawTourPicture(picture).WritePng(path);
}

}  // namespace vantage::picture
