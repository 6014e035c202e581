#include "client/picture/column_raster.h"

namespace vantage::picture {
namespace {

// Weak columns still show.
Colour Strengthen(const Colour& c, float strength) { return c.Alpha(0.45 + 0.55 * strength); }

Colour ColumnColour(const Column& column) {
  switch (column.shown) {
    case ColumnClass::kNothing:
      return {0, 0, 0, 0};
    case ColumnClass::kMeasuredFlat:
      return palette::kMeasuredFlat;
    case ColumnClass::kUnderSampledFlat:
      return palette::kUnderSampledFlat;
    case ColumnClass::kMeasured:
      return Strengthen(palette::kMeasured, column.strength);
    case ColumnClass::kUnderSampled:
      return Strengthen(palette::kUnderSampled, column.strength);
    case ColumnClass::kOcclusion:
      return Strengthen(palette::kOcclusion, column.strength);
    case ColumnClass::kHole:
      return Strengthen(palette::kHole, column.strength);
    case ColumnClass::kImage:
      return Strengthen(palette::kImageBoundary, column.strength);
  }
  return {0, 0, 0, 0};
}

}  // namespace

Raster CoverageRaster(const ColumnMap& map) {
  Raster raster(map.width(), map.height());
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      raster.At(x, map.height() - 1 - y) = ColumnColour(map.At(x, y));
    }
  }
  return raster;
}

Raster ContextRaster(const ColumnMap& map) {
  Raster raster(map.width(), map.height());
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const ColumnClass shown = map.At(x, y).shown;
      if (shown == ColumnClass::kMeasured || shown == ColumnClass::kUnderSampled) {
        raster.At(x, map.height() - 1 - y) = Strengthen(palette::kContext, map.At(x, y).strength);
      }
    }
  }
  return raster;
}

}  // namespace vantage::picture
