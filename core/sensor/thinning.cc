#include "core/sensor/thinning.h"

#include <algorithm>
#include <numbers>
#include <vector>

namespace vantage::sensor {
namespace {

// Indices of angles at least `step` apart, as evenly as they come: the next one is the nearest to a
// whole number of strides. `turn`: the first follows the last.
std::vector<int> Kept(const std::vector<double>& angles, double native, double step, bool turn) {
  std::vector<int> kept;
  // Steps are never measured so well that a ray should be lost to rounding.
  const double least = step - 0.5 * std::min(native, step);
  for (size_t i = 0; i < angles.size(); ++i) {
    if (!kept.empty() && angles[i] - angles[static_cast<size_t>(kept.back())] < least) continue;
    kept.push_back(static_cast<int>(i));
  }
  const double around = 2 * std::numbers::pi + angles.front();
  if (turn && kept.size() > 2 && around - angles[static_cast<size_t>(kept.back())] < least) {
    kept.pop_back();
  }
  return kept;
}

}  // namespace

RangeImage Thinned(const RangeImage& image, double step) {
  const std::vector<int> columns =
      Kept(image.azimuth, image.native_azimuth_step, step, image.full_turn);
  const std::vector<int> rows = Kept(image.elevation, image.native_elevation_step, step, false);
  if (columns.size() < 2 || rows.size() < 2) return image;
  RangeImage thin;
  thin.full_turn = image.full_turn;
  thin.native_azimuth_step = image.native_azimuth_step;
  thin.native_elevation_step = image.native_elevation_step;
  thin.range.reserve(columns.size() * rows.size());
  for (const int column : columns) {
    thin.azimuth.push_back(image.azimuth[static_cast<size_t>(column)]);
    for (const int row : rows) {
      const size_t cell = image.Index(column, row);
      thin.range.push_back(image.range[cell]);
      const Appearance& all = image.appearance;
      if (!all.intensity.empty()) thin.appearance.intensity.push_back(all.intensity[cell]);
      if (!all.colour.empty()) thin.appearance.colour.push_back(all.colour[cell]);
    }
  }
  for (const int row : rows) thin.elevation.push_back(image.elevation[static_cast<size_t>(row)]);
  // Where hardly anything came back, the few returns may all be left out.
  return thin.SampleCount() == 0 ? image : thin;
}

}  // namespace vantage::sensor
