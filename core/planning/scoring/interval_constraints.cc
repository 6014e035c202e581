#include "core/planning/scoring/interval_constraints.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vantage::planning {
namespace {

constexpr double kSlack = 1e-6;

// Bounds of the sum of products, each of a number in [a0, a1] and one in [b0, b1].
void AddProduct(double a0, double a1, double b0, double b1, Interval& sum) {
  const double p = a0 * b0;
  const double q = a0 * b1;
  const double r = a1 * b0;
  const double s = a1 * b1;
  sum.min += std::min(std::min(p, q), std::min(r, s));
  sum.max += std::max(std::max(p, q), std::max(r, s));
}

double SinOf(double height, double horizontal) {
  const double range = std::sqrt(height * height + horizontal * horizontal);
  return range > 0 ? height / range : 0;
}

// h / (h^2 + d^2)^(3/2): density for one sample per steradian, at height h over the plane and
// lateral distance d.
double Unit(double h, double d2) {
  const double r2 = h * h + d2;
  return r2 > 0 ? h / (r2 * std::sqrt(r2)) : std::numeric_limits<double>::infinity();
}

}  // namespace

CellBounds CellBounds::Of(const CellArrays& cells, size_t begin, size_t end) {
  CellBounds bounds;
  bounds.least_density = std::numeric_limits<float>::infinity();
  for (size_t i = begin; i < end; ++i) {
    bounds.position.extend(Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]));
    bounds.normal.extend(Eigen::Vector3f(cells.nx[i], cells.ny[i], cells.nz[i]));
    bounds.least_density = std::min(bounds.least_density, cells.q[i]);
    bounds.most_enough = std::max(bounds.most_enough, cells.enough[i]);
    bounds.has_dropouts |= !cells.DropoutsOf(i).empty();
    bounds.under_sky |= cells.UnderSky(i);
  }
  const Eigen::Vector3d centre = bounds.position.cast<double>().center();
  bounds.offset_min = std::numeric_limits<double>::infinity();
  bounds.offset_max = -bounds.offset_min;
  for (size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]).cast<double>();
    const Eigen::Vector3d n = Eigen::Vector3f(cells.nx[i], cells.ny[i], cells.nz[i]).cast<double>();
    const double offset = n.dot(p - centre);
    bounds.offset_min = std::min(bounds.offset_min, offset);
    bounds.offset_max = std::max(bounds.offset_max, offset);
  }
  return bounds;
}

// Distances between the boxes, along the vertical and across it.
struct IntervalConstraints::Geometry {
  Geometry(const Eigen::AlignedBox3d& views, const Eigen::AlignedBox3d& cells) {
    const Eigen::Vector3d low = cells.min() - views.max();
    const Eigen::Vector3d high = cells.max() - views.min();
    const Eigen::Vector3d near = low.cwiseMax(-high).cwiseMax(0.0);
    const Eigen::Vector3d far = low.cwiseAbs().cwiseMax(high.cwiseAbs());
    rise = {low.z(), high.z()};
    upright = {near.z(), far.z()};
    horizontal2 = {near.x() * near.x() + near.y() * near.y(),
                   far.x() * far.x() + far.y() * far.y()};
    range2 = {horizontal2.min + near.z() * near.z(), horizontal2.max + far.z() * far.z()};
    range = {std::sqrt(range2.min), std::sqrt(range2.max)};
  }
  Interval SinElevation() const {
    const double near = std::sqrt(horizontal2.min);
    const double far = std::sqrt(horizontal2.max);
    return {SinOf(rise.min, rise.min < 0 ? near : far), SinOf(rise.max, rise.max > 0 ? near : far)};
  }

  Interval rise;         // of the cell over the view
  Interval upright;      // its absolute value
  Interval horizontal2;  // squared
  Interval range2;
  Interval range;
};

IntervalConstraints::IntervalConstraints(const SensingConstraints& constraints) {
  const sensor::ScannerModel& scanner = constraints.scanner();
  per_steradian_ = 1 / (scanner.azimuth_step * scanner.elevation_step);
  least_cos_ = std::sin(scanner.elevation_step);
  range_min_ = scanner.range_min;
  range_max_ = scanner.range_max;
  sin_min_ =
      scanner.elevation_min <= -sensor::kPi / 2 + 1e-6 ? -2 : std::sin(scanner.elevation_min);
  sin_max_ = scanner.elevation_max >= sensor::kPi / 2 - 1e-6 ? 2 : std::sin(scanner.elevation_max);
  cos_incidence_ = std::cos(scanner.max_incidence);
}

Interval IntervalConstraints::Facing(const Eigen::AlignedBox3d& views,
                                     const Eigen::AlignedBox3d& position,
                                     const CellBounds& cells) const {
  // n . (v - p), bounded directly and by way of the centre c: n . (v - c) - n . (p - c).
  Interval direct;
  Interval split{-cells.offset_max, -cells.offset_min};
  for (int a = 0; a < 3; ++a) {
    const double n0 = cells.normal.min()[a];
    const double n1 = cells.normal.max()[a];
    const double centre = 0.5 * (position.min()[a] + position.max()[a]);
    AddProduct(n0, n1, views.min()[a] - position.max()[a], views.max()[a] - position.min()[a],
               direct);
    AddProduct(n0, n1, views.min()[a] - centre, views.max()[a] - centre, split);
  }
  return {std::max(direct.min, split.min), std::min(direct.max, split.max)};
}

Interval IntervalConstraints::PerSteradian(const Geometry& geometry) const {
  // From the bounds of the elevation's cosine.
  const double far2 = geometry.horizontal2.max + geometry.upright.min * geometry.upright.min;
  const double near2 = geometry.horizontal2.min + geometry.upright.max * geometry.upright.max;
  const double cos_max = far2 > 0 ? std::sqrt(geometry.horizontal2.max / far2) : 1;
  const double cos_min = near2 > 0 ? std::sqrt(geometry.horizontal2.min / near2) : 0;
  return {per_steradian_ / std::max(cos_max, least_cos_),
          per_steradian_ / std::max(cos_min, least_cos_)};
}

double IntervalConstraints::LeastPerSteradian(const Eigen::AlignedBox3d& views,
                                              const CellBounds& cells) const {
  return PerSteradian(Geometry(views, cells.position.cast<double>())).min;
}

Interval IntervalConstraints::Density(const Geometry& geometry, const Interval& facing) const {
  const Interval range = {std::max(geometry.range.min, range_min_),
                          std::max(std::min(geometry.range.max, range_max_), range_min_)};
  const double h0 = std::max(0.0, facing.min);
  const double h1 = std::max(0.0, std::min(facing.max, range.max));
  // Lateral distance over the rectangle of (h, d), as far as the range allows.
  const double d0 = std::max(0.0, range.min * range.min - h1 * h1);
  const double d1 = std::max(0.0, range.max * range.max - h0 * h0);
  const double peak = std::clamp(std::sqrt(d0 / 2), std::min(h0, h1), h1);
  const double r0 = range.min;
  const double r1 = range.max;
  const double most = std::min(Unit(peak, d0), std::min(h1, r0) / (r0 * r0 * r0));
  const double least = std::max(std::min(Unit(h0, d1), Unit(h1, d1)), h0 / (r1 * r1 * r1));
  const Interval rho = PerSteradian(geometry);
  return {rho.min * least, rho.max * most};
}

PairBounds IntervalConstraints::Bound(const Eigen::AlignedBox3d& views,
                                      const CellBounds& cells) const {
  const Eigen::AlignedBox3d position = cells.position.cast<double>();
  const Geometry geometry(views, position);
  PairBounds bounds;
  bounds.range = geometry.range;
  bounds.facing = Facing(views, position, cells);
  const double near = std::max(geometry.range.min, 1e-12);
  const double far = std::max(geometry.range.max, 1e-12);
  bounds.cos_incidence = {std::max(-1.0, bounds.facing.min / (bounds.facing.min > 0 ? far : near)),
                          std::min(1.0, bounds.facing.max / (bounds.facing.max > 0 ? near : far))};
  bounds.sin_elevation = geometry.SinElevation();
  bounds.density = Density(geometry, bounds.facing);
  return bounds;
}

bool IntervalConstraints::Test(const Eigen::AlignedBox3d& views, const CellBounds& cells,
                               uint8_t& satisfied, Interval& density) const {
  // The cheapest and most selective test comes first.
  const Eigen::AlignedBox3d position = cells.position.cast<double>();
  const Interval facing = Facing(views, position, cells);
  if (facing.max <= 0) return false;
  const Geometry geometry(views, position);
  if (!(satisfied & kRangeSatisfied)) {
    if (geometry.range.min > range_max_ * (1 + kSlack)) return false;
    if (geometry.range.max < range_min_ * (1 - kSlack)) return false;
    if (geometry.range.min > range_min_ * (1 + kSlack) &&
        geometry.range.max < range_max_ * (1 - kSlack)) {
      satisfied |= kRangeSatisfied;
    }
  }
  if (!(satisfied & kIncidenceSatisfied)) {
    if (facing.max < (cos_incidence_ - kSlack) * geometry.range.min) return false;
    if (facing.min > (cos_incidence_ + kSlack) * geometry.range.max) {
      satisfied |= kIncidenceSatisfied;
    }
  }
  if (!(satisfied & kElevationSatisfied)) {
    const Interval sine = geometry.SinElevation();
    if (sine.max < sin_min_ - kSlack || sine.min > sin_max_ + kSlack) return false;
    if (sine.min > sin_min_ + kSlack && sine.max < sin_max_ - kSlack) {
      satisfied |= kElevationSatisfied;
    }
  }
  density = Density(geometry, facing);
  return density.max * (1 + kSlack) > static_cast<double>(cells.least_density);
}

}  // namespace vantage::planning
