#include <algorithm>
#include <utility>

#include "core/model/scan/range_surface.h"

namespace vantage::model {
namespace {

// Every so many of `count` lines: the first of a closed axis and on, of an open one with as many
// left out at either end.
std::vector<int> LinesOf(int count, int stride, bool closed) {
  std::vector<int> lines;
  for (int i = closed ? 0 : (count - 1) % stride / 2; i < count; i += stride) lines.push_back(i);
  return lines;
}

std::vector<double> AnglesOf(const AngularAxis& axis, const std::vector<int>& lines) {
  std::vector<double> angles;
  angles.reserve(lines.size());
  for (const int line : lines) angles.push_back(axis.angles()[static_cast<size_t>(line)]);
  return angles;
}

}  // namespace

RangeSurface RangeSurface::Thinned(int column_stride, int row_stride,
                                   parallel::Parallel& parallel) const {
  const std::vector<int> kept_columns = LinesOf(columns(), column_stride, azimuth_.closed());
  const std::vector<int> kept_rows = LinesOf(rows(), row_stride, false);
  std::vector<float> range(kept_columns.size() * kept_rows.size());
  std::vector<uint8_t> joined(range.size());
  // What lies between two kept cells, up to the second one.
  const auto all_joined = [&](int first, int end, int r, auto&& to_next) {
    for (int c = first; c < end; ++c) {
      if (!to_next(c % columns(), r)) return false;
    }
    return true;
  };
  const auto bits_of = [&](int first, int end, size_t row) {
    const int r = kept_rows[row];
    const int above = row + 1 < kept_rows.size() ? kept_rows[row + 1] : r;
    const auto right = [this](int c, int at) { return JoinedToNextColumn(c, at); };
    const auto quad = [this](int c, int at) { return QuadJoined(c, at); };
    uint8_t bits = 0;
    if (first < end && all_joined(first, end, r, right)) bits |= 1;
    bool up = above > r;
    for (int at = r; at < above && up; ++at) up = JoinedToNextRow(first, at);
    if (up) bits |= 2;
    bool inside = bits == 3;
    for (int at = r; at < above && inside; ++at) inside = all_joined(first, end, at, quad);
    if (inside) bits |= 4;
    return bits;
  };
  parallel.For(kept_columns.size(), [&](size_t i) {
    const int first = kept_columns[i];
    // Where the second column is the first of a closed axis, it is counted on.
    const int end = i + 1 < kept_columns.size() ? kept_columns[i + 1]
                    : azimuth_.closed()         ? columns() + kept_columns.front()
                                                : first;
    for (size_t row = 0; row < kept_rows.size(); ++row) {
      const size_t from = Index(first, kept_rows[row]);
      const size_t to = i * kept_rows.size() + row;
      range[to] = range_[from];
      joined[to] = (joined_[from] & 8) != 0 ? joined_[from] : bits_of(first, end, row);
    }
  });
  RangeSurface thinned(AngularAxis(AnglesOf(azimuth_, kept_columns), azimuth_.closed()),
                       AngularAxis(AnglesOf(elevation_, kept_rows), false), std::move(range),
                       std::move(joined));
  thinned.range_sigma_ = range_sigma_;
  return thinned;
}

}  // namespace vantage::model
