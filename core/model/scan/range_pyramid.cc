#include "core/model/scan/range_pyramid.h"

#include <algorithm>

namespace vantage::model {

RangePyramid::RangePyramid(const RangeSurface& surface, parallel::Parallel& parallel) {
  // Columns at a time, so that a task is worth its while.
  constexpr int kColumns = 64;
  const auto fill = [&](Level& level, const auto& column) {
    level.bounds.resize(static_cast<size_t>(level.columns) * static_cast<size_t>(level.rows));
    parallel.For(static_cast<size_t>((level.columns + kColumns - 1) / kColumns), [&](size_t part) {
      const int first = static_cast<int>(part) * kColumns;
      for (int c = first; c < std::min(first + kColumns, level.columns); ++c) {
        column(c, &level.bounds[static_cast<size_t>(c * level.rows)]);
      }
    });
  };
  Level base;
  base.columns = surface.columns();
  base.rows = surface.rows();
  fill(base, [&](int c, Bounds* to) {
    for (int r = 0; r < base.rows; ++r) {
      const float known = std::max(0.0f, surface.at(c, r));
      to[r] = {known, known};
    }
  });
  levels_.push_back(std::move(base));
  while (levels_.back().columns > 1 || levels_.back().rows > 1) {
    const Level& below = levels_.back();
    Level level;
    level.columns = (below.columns + 1) / 2;
    level.rows = (below.rows + 1) / 2;
    fill(level, [&](int c, Bounds* to) {
      for (int r = 0; r < level.rows; ++r) {
        Bounds all = below.bounds[static_cast<size_t>(2 * c * below.rows + 2 * r)];
        for (int dc = 0; dc < 2 && 2 * c + dc < below.columns; ++dc) {
          for (int dr = 0; dr < 2 && 2 * r + dr < below.rows; ++dr) {
            const Bounds& part =
                below.bounds[static_cast<size_t>((2 * c + dc) * below.rows + 2 * r + dr)];
            all.min = std::min(all.min, part.min);
            all.max = std::max(all.max, part.max);
          }
        }
        to[r] = all;
      }
    });
    levels_.push_back(std::move(level));
  }
}

RangePyramid::Bounds RangePyramid::Over(int first_column, int last_column, int first_row,
                                        int last_row) const {
  size_t l = 0;
  // At most three nodes a side: tight enough, and nine look-ups at the most.
  while ((last_column >> l) - (first_column >> l) > 2 || (last_row >> l) - (first_row >> l) > 2) {
    ++l;
  }
  const Level& level = levels_[l];
  const int c0 = first_column >> l, c1 = last_column >> l;
  const int r0 = first_row >> l, r1 = last_row >> l;
  Bounds all = level.bounds[static_cast<size_t>(c0 * level.rows + r0)];
  for (int c = c0; c <= c1; ++c) {
    for (int r = r0; r <= r1; ++r) {
      const Bounds& part = level.bounds[static_cast<size_t>(c * level.rows + r)];
      all.min = std::min(all.min, part.min);
      all.max = std::max(all.max, part.max);
    }
  }
  return all;
}

}  // namespace vantage::model
