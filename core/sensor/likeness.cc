#include "core/sensor/likeness.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace vantage::sensor {
namespace {

// m, and of the range: noise, and a surface that is seen slantwise between two directions.
constexpr double kSameRange = 0.02;
constexpr double kSameShare = 0.01;
constexpr float kTellsLittle = 0.05f;  // of a row's common range: what is as near as that
constexpr size_t kLeastTelling = 100;  // directions: fewer say little
constexpr size_t kMostLooks = 4096;    // that are compared

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

size_t StrideOf(const RangeImage& image) {
  // Odd, so that it does not keep to some rows of an even number.
  return std::max<size_t>(1, image.cells() / kMostLooks) | 1;
}

}  // namespace

double ShareThatAgrees(const RangeImage& whole, const RangeImage& preview) {
  const std::vector<float> common = CommonRanges(preview);
  const size_t stride = StrideOf(preview);
  struct Count {
    size_t looks = 0;
    size_t agree = 0;
    double share() const {
      return looks == 0 ? 0 : static_cast<double>(agree) / static_cast<double>(looks);
    }
  };
  Count all;
  Count telling;
  for (size_t cell = 0; cell < preview.cells(); cell += stride) {
    const float expected = preview.range[cell];
    const size_t rows = preview.elevation.size();
    if (!RangeImage::IsRange(expected)) continue;
    const bool tells =
        std::abs(expected - common[cell % rows]) > kTellsLittle * common[cell % rows];
    const auto column =
        Nearest(whole.azimuth, preview.azimuth[cell / rows], 2 * preview.native_azimuth_step);
    const auto row =
        Nearest(whole.elevation, preview.elevation[cell % rows], 2 * preview.native_elevation_step);
    if (!column.has_value() || !row.has_value()) continue;
    const double apart = kSameRange + kSameShare * static_cast<double>(expected);
    bool same = false;
    for (int c = std::max(0, *column - 1); c <= std::min(whole.columns() - 1, *column + 1); ++c) {
      for (int r = std::max(0, *row - 1); r <= std::min(whole.rows() - 1, *row + 1); ++r) {
        const float range = whole.at(c, r);
        same = same || (RangeImage::IsRange(range) &&
                        std::abs(static_cast<double>(range - expected)) <= apart);
      }
    }
    for (Count* count : {&all, &telling}) {
      if (count == &telling && !tells) continue;
      ++count->looks;
      if (same) ++count->agree;
    }
  }
  // In a round place every row is the same all around, and all that there is has to do.
  return telling.looks >= kLeastTelling ? telling.share() : all.share();
}

bool SameSamples(const RangeImage& a, const RangeImage& b) {
  constexpr double kSameDirection = 0.05;  // of a step: rounding
  constexpr float kLastDigit = 1.5e-4f;    // m
  constexpr size_t kLeastShared = 200;     // returns: fewer prove nothing
  constexpr double kLeastEqual = 0.9;      // of them: exporters filter some
  const bool less = b.cells() < a.cells();
  const RangeImage& coarse = less ? b : a;
  const RangeImage& fine = less ? a : b;
  const size_t rows = coarse.elevation.size();
  const size_t stride = StrideOf(coarse);
  size_t shared = 0;
  size_t equal = 0;
  for (size_t cell = 0; cell < coarse.cells(); cell += stride) {
    const float range = coarse.range[cell];
    if (!RangeImage::IsRange(range)) continue;
    const auto column = Nearest(fine.azimuth, coarse.azimuth[cell / rows],
                                kSameDirection * fine.native_azimuth_step);
    const auto row = Nearest(fine.elevation, coarse.elevation[cell % rows],
                             kSameDirection * fine.native_elevation_step);
    if (!column.has_value() || !row.has_value()) continue;
    const float other = fine.at(*column, *row);
    if (!RangeImage::IsRange(other)) continue;
    ++shared;
    if (std::abs(other - range) <= kLastDigit) ++equal;
  }
  return shared >= kLeastShared &&
         static_cast<double>(equal) >= kLeastEqual * static_cast<double>(shared);
}

}  // namespace vantage::sensor
