#include "core/sensor/scanner_body.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace vantage::sensor {

void MaskScannerBody(double range_min, double blind_zone, RangeImage& image) {
  const int columns = image.columns();
  const int rows = image.rows();
  struct Reached {
    int column, row;            // set to no information
    int body_column, body_row;  // the cell of the body that it was reached from
  };
  constexpr double kRounding = 1e-3;  // m; files round coordinates, and ranges sit on the limit
  std::deque<Reached> front;
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      float& cell = image.range[image.Index(column, row)];
      if (!RangeImage::IsRange(cell) || cell >= range_min + kRounding) continue;
      cell = RangeImage::kNoInformation;
      front.push_back({column, row, column, row});
    }
  }
  const double cos_zone = std::cos(blind_zone);
  while (!front.empty()) {
    const Reached from = front.front();
    front.pop_front();
    for (int dc = -1; dc <= 1; ++dc) {
      int column = from.column + dc;
      if (image.full_turn) column = (column + columns) % columns;
      if (column < 0 || column >= columns) continue;
      for (int row = std::max(from.row - 1, 0); row <= std::min(from.row + 1, rows - 1); ++row) {
        float& cell = image.range[image.Index(column, row)];
        if (cell != RangeImage::kNoReturn) continue;
        const double cos_angle =
            image.Direction(column, row).dot(image.Direction(from.body_column, from.body_row));
        if (cos_angle < cos_zone) continue;
        cell = RangeImage::kNoInformation;
        front.push_back({column, row, from.body_column, from.body_row});
      }
    }
  }
}

}  // namespace vantage::sensor
