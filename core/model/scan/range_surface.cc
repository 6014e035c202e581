#include "core/model/scan/range_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace vantage::model {

namespace {

// Runs of columns that are worked on at the same time, in order.
struct ColumnParts {
  ColumnParts(int all, const parallel::Parallel& parallel)
      : columns(all),
        count(parallel.width() == 1
                  ? 1
                  : static_cast<size_t>(std::clamp(columns, 1, 8 * parallel.width()))) {}

  int first(size_t part) const {
    return static_cast<int>(part * static_cast<size_t>(columns) / count);
  }
  int end(size_t part) const { return first(part + 1); }

  int columns;
  size_t count;
};

}  // namespace

RangeSurface::RangeSurface(const sensor::RangeImage& image, const sensor::ScannerModel& scanner,
                           double discontinuity_angle, parallel::Parallel& parallel)
    : RangeSurface(image, scanner) {
  (void)JoinAll(discontinuity_angle, parallel);
}

RangeSurface::RangeSurface(const sensor::RangeImage& image, const sensor::ScannerModel& scanner)
    : azimuth_(image.azimuth, image.full_turn),
      elevation_(image.elevation, false),
      range_(image.range),
      range_sigma_(scanner.RangeSigma(scanner.range_max)),
      joined_(image.cells(), 0) {
  FillTables();
  for (float& range : range_) {
    if (sensor::RangeImage::IsRange(range) && range < static_cast<float>(scanner.range_min)) {
      range = sensor::RangeImage::kNoInformation;
    }
  }
}

std::vector<uint32_t> RangeSurface::JoinAll(double discontinuity_angle,
                                            parallel::Parallel& parallel) {
  Join(discontinuity_angle, parallel);
  std::vector<uint32_t> mixed = DropMixedPixels(parallel);
  JoinQuads(parallel);
  return mixed;
}

RangeSurface::RangeSurface(AngularAxis azimuth, AngularAxis elevation, std::vector<float> range,
                           std::vector<uint8_t> joined)
    : azimuth_(std::move(azimuth)),
      elevation_(std::move(elevation)),
      range_(std::move(range)),
      joined_(std::move(joined)) {
  FillTables();
  ends_in_sky_ = std::any_of(joined_.begin(), joined_.end(),
                             [](uint8_t bits) { return EndReason(bits) >= UnknownReason::kSky; });
}

void RangeSurface::FillTables() {
  for (const double a : azimuth_.angles()) {
    cos_azimuth_.push_back(std::cos(a));
    sin_azimuth_.push_back(std::sin(a));
  }
  for (const double e : elevation_.angles()) {
    cos_elevation_.push_back(std::cos(e));
    sin_elevation_.push_back(std::sin(e));
  }
}

void RangeSurface::Join(double discontinuity_angle, parallel::Parallel& parallel) {
  const double tangent = std::tan(discontinuity_angle);
  // Five sigma of a difference of two ranges: what noise alone explains is no discontinuity. Of
  // five million pairs three are beyond.
  const double noise = 5 * std::sqrt(2.0) * range_sigma_;
  const auto one_surface = [&](float a, float b, double angle) {
    if (!sensor::RangeImage::IsRange(a) || !sensor::RangeImage::IsRange(b)) return false;
    const double depth = std::abs(static_cast<double>(a) - static_cast<double>(b));
    const double lateral = static_cast<double>(std::min(a, b)) * angle;  // angles are small here
    return depth <= noise || lateral >= depth * tangent;
  };
  const auto step_to = [](double from, double to) {
    return to > from ? to - from : to + 2 * sensor::kPi - from;
  };
  std::vector<double> rise(static_cast<size_t>(rows()), sensor::kPi);
  for (size_t r = 0; r + 1 < rise.size(); ++r) {
    rise[r] = std::asin(sin_elevation_[r + 1]) - std::asin(sin_elevation_[r]);
  }
  const auto join_column = [&](int c) {
    const int next = NextColumn(c);
    // A gap this wide was not scanned: nothing is known to join across it. 6 degrees, six steps of
    // the coarsest scanner that this is tested with.
    constexpr double kWidestGap = 0.1;  // rad
    const double turn = next < 0 ? sensor::kPi
                                 : step_to(std::atan2(sin_azimuth_[c], cos_azimuth_[c]),
                                           std::atan2(sin_azimuth_[next], cos_azimuth_[next]));
    for (int r = 0; r < rows(); ++r) {
      uint8_t& joined = joined_[Index(c, r)];
      if (next >= 0 && turn < kWidestGap &&
          one_surface(at(c, r), at(next, r), turn * cos_elevation_[r])) {
        joined |= 1;
      }
      if (rise[r] < kWidestGap && one_surface(at(c, r), at(c, r + 1), rise[r])) joined |= 2;
    }
  };
  const ColumnParts parts(columns(), parallel);
  parallel.For(parts.count, [&](size_t part) {
    for (int c = parts.first(part); c < parts.end(part); ++c) join_column(c);
  });
}

std::vector<uint32_t> RangeSurface::DropMixedPixels(parallel::Parallel& parallel) {
  const auto between = [](float before, float here, float after) {
    return sensor::RangeImage::IsRange(before) && sensor::RangeImage::IsRange(after) &&
           (here - before) * (after - here) > 0;
  };
  // A cell's neighbours that it is joined to, and whether it may mix those of them that it is not.
  struct Around {
    int joined = 0;
    int column = 0;  // of the last of those
    int row = 0;
    bool across = false;
    bool along = false;
  };
  const auto look = [&](int c, int r) {
    const int next = NextColumn(c);
    const int previous = c > 0 ? c - 1 : (azimuth_.closed() ? columns() - 1 : -1);
    Around around;
    const auto join = [&around](bool joined, int column, int row) {
      if (!joined) return;
      ++around.joined;
      around.column = column;
      around.row = row;
    };
    const bool left = previous >= 0 && JoinedToNextColumn(previous, r);
    const bool right = JoinedToNextColumn(c, r);
    const bool below = r > 0 && JoinedToNextRow(c, r - 1);
    const bool above = JoinedToNextRow(c, r);
    join(left, previous, r);
    join(right, next, r);
    join(below, c, r - 1);
    join(above, c, r + 1);
    const float here = at(c, r);
    around.across = !left && !right && previous >= 0 && next >= 0 &&
                    between(at(previous, r), here, at(next, r));
    around.along =
        !below && !above && r > 0 && r + 1 < rows() && between(at(c, r - 1), here, at(c, r + 1));
    return around;
  };
  const auto find_in = [&](int c, std::vector<uint32_t>& mixed) {
    for (int r = 0; r < rows(); ++r) {
      if (!sensor::RangeImage::IsRange(at(c, r))) continue;
      const Around here = look(c, r);
      if (here.joined > 1 || !(here.across || here.along)) continue;
      if (here.joined == 1) {
        // Two that mix the same edges, one above the other, have like ranges by chance: with fine
        // steps some of the hundreds at a door frame do.
        const Around other = look(here.column, here.row);
        const bool pair =
            other.joined == 1 && ((here.across && other.across) || (here.along && other.along));
        if (!pair) continue;
      }
      mixed.push_back(static_cast<uint32_t>(Index(c, r)));
    }
  };
  const ColumnParts parts(columns(), parallel);
  std::vector<std::vector<uint32_t>> mixed(parts.count);
  parallel.For(parts.count, [&](size_t part) {
    for (int c = parts.first(part); c < parts.end(part); ++c) find_in(c, mixed[part]);
  });
  std::vector<uint32_t> all;
  for (const std::vector<uint32_t>& some : mixed) all.insert(all.end(), some.begin(), some.end());
  for (const uint32_t index : all) range_[index] = sensor::RangeImage::kNoInformation;
  return all;
}

void RangeSurface::JoinQuads(parallel::Parallel& parallel) {
  const auto join_column = [this](int c) {
    const int next = NextColumn(c);
    if (next < 0) return;
    for (int r = 0; r + 1 < rows(); ++r) {
      const bool quad = JoinedToNextColumn(c, r) && JoinedToNextRow(c, r) &&
                        JoinedToNextColumn(c, r + 1) && JoinedToNextRow(next, r);
      if (quad) joined_[Index(c, r)] |= 4;
    }
  };
  const ColumnParts parts(columns(), parallel);
  parallel.For(parts.count, [&](size_t part) {
    // The last column reads the first of the next part, which is being written.
    for (int c = parts.first(part); c + 1 < parts.end(part); ++c) join_column(c);
  });
  for (size_t part = 0; part < parts.count; ++part) {
    if (parts.first(part) < parts.end(part)) join_column(parts.end(part) - 1);
  }
}

OpenRangeSurface::OpenRangeSurface(const sensor::RangeImage& image,
                                   const sensor::ScannerModel& scanner, double discontinuity_angle,
                                   parallel::Parallel& parallel)
    : RangeSurface(image, scanner), mixed_(JoinAll(discontinuity_angle, parallel)) {}

void OpenRangeSurface::EndAt(int column, int row, float range, UnknownReason beyond) {
  const size_t own = Index(column, row);
  range_[own] = range;
  joined_[own] = EndBits(beyond);
  ends_in_sky_ |= beyond >= UnknownReason::kSky;
  const int previous = column > 0 ? column - 1 : (azimuth_.closed() ? columns() - 1 : -1);
  const auto part = [this](int c, int r, int bits) {
    uint8_t& joined = joined_[Index(c, r)];
    if ((joined & 8) == 0) joined = static_cast<uint8_t>(joined & ~bits);
  };
  if (row > 0) part(column, row - 1, 2 | 4);
  if (previous >= 0) part(previous, row, 1 | 4);
  if (previous >= 0 && row > 0) part(previous, row - 1, 4);
}

RangeSurface OpenRangeSurface::Finish(parallel::Parallel& parallel) && {
  constexpr int kTelling = 7;  // of eight neighbours: a cell of a line has six at most
  struct End {
    size_t index;
    float range;
    bool in_sky = false;  // what tells is the sky, but for stray returns
  };
  std::vector<End> ends;
  constexpr size_t kOutside = ~size_t{0};
  const auto index_beside = [this](int column, int row, int dc, int dr) {
    int c = column + dc;
    if (azimuth_.closed()) c = (c + columns()) % columns();
    const int r = row + dr;
    return c < 0 || c >= columns() || r < 0 || r >= rows() ? kOutside : Index(c, r);
  };
  const auto beside = [&](int column, int row, int dc, int dr) {
    const size_t index = index_beside(column, row, dc, dr);
    return index == kOutside ? sensor::RangeImage::kNoInformation : range_[index];
  };
  for (const uint32_t index : mixed_) {
    const int c = static_cast<int>(index) / rows();
    const int r = static_cast<int>(index) % rows();
    float nearest = std::numeric_limits<float>::infinity();
    for (const auto& [dc, dr] : {std::pair{1, 0}, std::pair{0, 1}}) {
      const float before = beside(c, r, -dc, -dr);
      const float after = beside(c, r, dc, dr);
      if (sensor::RangeImage::IsRange(before) && sensor::RangeImage::IsRange(after)) {
        nearest = std::min({nearest, before, after});
      }
    }
    if (std::isfinite(nearest)) ends.push_back({index, nearest});
  }
  const auto look_in = [&](int c, std::vector<End>& found) {
    for (int r = 0; r < rows(); ++r) {
      if (sensor::RangeImage::IsRange(at(c, r))) continue;
      int telling = 0;
      int sky = 0;
      float nearest = std::numeric_limits<float>::infinity();
      for (int dc = -1; dc <= 1; ++dc) {
        for (int dr = -1; dr <= 1; ++dr) {
          const size_t index = index_beside(c, r, dc, dr);
          if (index == kOutside || !sensor::RangeImage::IsRange(range_[index])) continue;
          ++telling;
          sky += EndReason(joined_[index]) == UnknownReason::kSky ? 1 : 0;
          nearest = std::min(nearest, range_[index]);
        }
      }
      if (telling >= kTelling) found.push_back({Index(c, r), nearest, 2 * sky > telling});
    }
  };
  const ColumnParts parts(columns(), parallel);
  std::vector<std::vector<End>> found(parts.count);
  parallel.For(parts.count, [&](size_t part) {
    for (int c = parts.first(part); c < parts.end(part); ++c) look_in(c, found[part]);
  });
  for (const std::vector<End>& some : found) ends.insert(ends.end(), some.begin(), some.end());
  for (const End& end : ends) {
    if (sensor::RangeImage::IsRange(range_[end.index]))
      continue;  // a mixed pixel that stands alone
    joined_[end.index] =
        EndBits(end.in_sky                                           ? UnknownReason::kSky
                : range_[end.index] == sensor::RangeImage::kNoReturn ? UnknownReason::kHole
                                                                     : UnknownReason::kImage);
    range_[end.index] = end.range;
  }
  return static_cast<RangeSurface&&>(*this);
}

RangeSurface::Reading RangeSurface::Read(const Eigen::Vector3d& direction) const {
  const double level = std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
  return RangeAt(std::atan2(direction.y(), direction.x()), std::atan2(direction.z(), level));
}

}  // namespace vantage::model
