#include "core/sensor/thinning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace vantage::sensor {
namespace {

// m, and of the range: noise, and a surface that is seen slantwise between two directions.
constexpr double kSameRange = 0.02;
constexpr double kSameShare = 0.01;
constexpr float kTellsLittle = 0.05f;  // of a row's common range: what is as near as that
constexpr size_t kMostLooks = 4096;    // directions that are compared

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

// The index of the nearest angle, if it is within `apart`.
std::optional<int> Nearest(const std::vector<double>& angles, double angle, double apart) {
  const auto above = std::lower_bound(angles.begin(), angles.end(), angle);
  auto best = above == angles.end() ? above - 1 : above;
  if (above != angles.begin() && (above == angles.end() || angle - *(above - 1) < *above - angle)) {
    best = above - 1;
  }
  if (std::abs(*best - angle) > apart) return std::nullopt;
  return static_cast<int>(best - angles.begin());
}

// Of each row the median of its ranges, m; 0 where nothing came back. It is that of floor or
// ceiling where those fill the row, which a tripod of the same height sees from everywhere.
std::vector<float> CommonRanges(const RangeImage& image) {
  std::vector<float> common;
  std::vector<float> ranges;  // of one row
  for (int row = 0; row < image.rows(); ++row) {
    ranges.clear();
    for (int column = 0; column < image.columns(); ++column) {
      if (RangeImage::IsRange(image.at(column, row))) ranges.push_back(image.at(column, row));
    }
    const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
    std::nth_element(ranges.begin(), middle, ranges.end());
    common.push_back(ranges.empty() ? 0.0f : *middle);
  }
  return common;
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
    for (const int row : rows) thin.range.push_back(image.at(column, row));
  }
  for (const int row : rows) thin.elevation.push_back(image.elevation[static_cast<size_t>(row)]);
  // Where hardly anything came back, the few returns may all be left out.
  return thin.SampleCount() == 0 ? image : thin;
}

double ShareThatAgrees(const RangeImage& whole, const RangeImage& preview) {
  const std::vector<float> common = CommonRanges(preview);
  const size_t stride = std::max<size_t>(1, preview.cells() / kMostLooks) | 1;
  size_t looks = 0;
  size_t agree = 0;
  for (size_t cell = 0; cell < preview.cells(); cell += stride) {
    const float expected = preview.range[cell];
    const size_t rows = preview.elevation.size();
    if (!RangeImage::IsRange(expected) ||
        std::abs(expected - common[cell % rows]) <= kTellsLittle * common[cell % rows]) {
      continue;
    }
    const auto column =
        Nearest(whole.azimuth, preview.azimuth[cell / rows], 2 * preview.native_azimuth_step);
    const auto row =
        Nearest(whole.elevation, preview.elevation[cell % rows], 2 * preview.native_elevation_step);
    if (!column.has_value() || !row.has_value()) continue;
    ++looks;
    const double apart = kSameRange + kSameShare * static_cast<double>(expected);
    bool same = false;
    for (int c = std::max(0, *column - 1); c <= std::min(whole.columns() - 1, *column + 1); ++c) {
      for (int r = std::max(0, *row - 1); r <= std::min(whole.rows() - 1, *row + 1); ++r) {
        const float range = whole.at(c, r);
        same = same || (RangeImage::IsRange(range) &&
                        std::abs(static_cast<double>(range - expected)) <= apart);
      }
    }
    if (same) ++agree;
  }
  return looks == 0 ? 0 : static_cast<double>(agree) / static_cast<double>(looks);
}

}  // namespace vantage::sensor
