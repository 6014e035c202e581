// Interval bounds against what sampling finds.
#include "core/planning/scoring/interval_constraints.h"
#include "tests/support/runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vantage::planning {
namespace {

class Sampler {
 public:
  explicit Sampler(uint64_t seed) : random_(seed) {}
  double Between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  Eigen::Vector3d In(const Eigen::AlignedBox3d& box) {
    Eigen::Vector3d p;
    for (int a = 0; a < 3; ++a) {
      // Extremes often lie at the ends.
      const uint64_t end = random_() % 6;
      p[a] = end == 0   ? box.min()[a]
             : end == 1 ? box.max()[a]
                        : Between(box.min()[a], box.max()[a]);
    }
    return p;
  }
  uint64_t Bits() { return random_(); }

 private:
  std::mt19937_64 random_;
};

// A piece of a plane, bumpy and with normals that vary, as packets of a patch tree hold them.
CellArrays RandomGroup(Sampler& sampler) {
  CellArrays cells;
  Eigen::Vector3d n(sampler.Between(-1, 1), sampler.Between(-1, 1), sampler.Between(-1, 1));
  if (sampler.Bits() % 2 == 0) n = Eigen::Vector3d::Unit(static_cast<int>(sampler.Bits() % 3));
  n.normalize();
  const Eigen::Vector3d u = n.unitOrthogonal();
  const Eigen::Vector3d v = n.cross(u);
  const double side = std::exp(sampler.Between(-3, 1));
  const double bump = sampler.Bits() % 2 == 0 ? 0 : 0.05;
  const double tilt = sampler.Bits() % 2 == 0 ? 0 : sampler.Between(0, 0.4);
  const Eigen::Vector3d centre(sampler.Between(-4, 4), sampler.Between(-4, 4),
                               sampler.Between(-2, 2));
  for (uint32_t i = 0; i < 12; ++i) {
    const Eigen::Vector3d p = centre + sampler.Between(-side, side) * u +
                              sampler.Between(-side, side) * v + sampler.Between(-bump, bump) * n;
    const Eigen::Vector3d normal =
        (n + tilt * Eigen::Vector3d(sampler.Between(-1, 1), sampler.Between(-1, 1),
                                    sampler.Between(-1, 1)))
            .normalized();
    cells.Add(p.cast<float>(), normal.cast<float>(), 1, static_cast<float>(sampler.Between(0, 900)),
              static_cast<float>(sampler.Between(1000, 9000)), p.cast<float>(), i);
  }
  cells.Pad();
  return cells;
}

Eigen::AlignedBox3d RandomViews(Sampler& sampler) {
  const double side = sampler.Bits() % 4 == 0 ? 0 : std::exp(sampler.Between(-3, 0.5));
  const Eigen::Vector3d low(sampler.Between(-4, 4), sampler.Between(-4, 4), sampler.Between(-2, 2));
  return {low, low + side * Eigen::Vector3d(1, sampler.Between(0.2, 1), sampler.Between(0.2, 1))};
}

TEST(IntervalConstraintsTest, BoundsContainEverySample) {
  constexpr int kPairs = test_support::Runs(20000);
  constexpr int kSamples = 60;  // 1.2 million views and cells
  sensor::ScannerModel scanner;
  scanner.range_max = 6;
  scanner.elevation_max = sensor::Radians(70);
  const SensingConstraints constraints(scanner);
  const IntervalConstraints intervals(constraints);
  Sampler sampler(5);
  int decided = 0;
  int violated = 0;
  double tightness = 0;
  int tight = 0;
  for (int pair = 0; pair < kPairs; ++pair) {
    const CellArrays cells = RandomGroup(sampler);
    const Eigen::AlignedBox3d views = RandomViews(sampler);
    const CellBounds group = CellBounds::Of(cells, 0, cells.size());
    const PairBounds bounds = intervals.Bound(views, group);
    uint8_t satisfied = 0;
    Interval density;
    const bool may = intervals.Test(views, group, satisfied, density);
    violated += !may;
    decided += satisfied == kSensingSatisfied;
    Interval sampled{1e30, -1e30};
    for (int k = 0; k < kSamples; ++k) {
      const Eigen::Vector3d view = sampler.In(views);
      const size_t i = sampler.Bits() % cells.size();
      const Eigen::Vector3d p = Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]).cast<double>();
      const Eigen::Vector3d n =
          Eigen::Vector3f(cells.nx[i], cells.ny[i], cells.nz[i]).cast<double>();
      const Eigen::Vector3d d = p - view;
      const double range = d.norm();
      if (range < 1e-3) continue;
      const double facing = -n.dot(d);
      const double sine = d.z() / range;
      const double margin = 1e-9;
      ASSERT_GE(range, bounds.range.min - margin) << "pair " << pair;
      ASSERT_LE(range, bounds.range.max + margin) << "pair " << pair;
      ASSERT_GE(facing, bounds.facing.min - margin) << "pair " << pair;
      ASSERT_LE(facing, bounds.facing.max + margin) << "pair " << pair;
      ASSERT_GE(facing / range, bounds.cos_incidence.min - margin) << "pair " << pair;
      ASSERT_LE(facing / range, bounds.cos_incidence.max + margin) << "pair " << pair;
      ASSERT_GE(sine, bounds.sin_elevation.min - margin) << "pair " << pair;
      ASSERT_LE(sine, bounds.sin_elevation.max + margin) << "pair " << pair;
      const bool in_range = range >= scanner.range_min && range <= scanner.range_max;
      if (in_range && facing > 0) {
        const double s =
            scanner.SamplingDensity(std::asin(std::clamp(sine, -1.0, 1.0)), facing / range, range);
        ASSERT_GE(s, bounds.density.min * (1 - margin)) << "pair " << pair;
        ASSERT_LE(s, bounds.density.max * (1 + margin)) << "pair " << pair;
        sampled.min = std::min(sampled.min, s);
        sampled.max = std::max(sampled.max, s);
      }
      const bool incident = facing >= std::cos(scanner.max_incidence) * range;
      const bool in_view =
          sine >= std::sin(scanner.elevation_min) && sine <= std::sin(scanner.elevation_max);
      if (satisfied & kRangeSatisfied) {
        ASSERT_TRUE(in_range) << "pair " << pair;
      }
      if (satisfied & kIncidenceSatisfied) {
        ASSERT_TRUE(incident) << "pair " << pair;
      }
      if (satisfied & kElevationSatisfied) {
        ASSERT_TRUE(in_view) << "pair " << pair;
      }
      const double gain = constraints.AddedDensity(view, p, n, static_cast<double>(cells.q[i]),
                                                   static_cast<double>(cells.enough[i]));
      if (!may) {
        ASSERT_EQ(gain, 0) << "pair " << pair;
      }
    }
    if (satisfied == kSensingSatisfied && bounds.density.max < 1e7) {
      tightness += (sampled.max - sampled.min) / (bounds.density.max - bounds.density.min + 1e-9);
      ++tight;
    }
  }
  // Bounds that say nothing contain everything too.
  EXPECT_GT(decided, kPairs / 50);
  EXPECT_GT(violated, kPairs / 4);
  EXPECT_GT(tightness / tight, 0.25);
}

TEST(IntervalConstraintsTest, PointsAreExact) {
  sensor::ScannerModel scanner;
  scanner.range_max = 6;
  const SensingConstraints constraints(scanner);
  const IntervalConstraints intervals(constraints);
  Sampler sampler(6);
  for (int k = 0; k < 20000; ++k) {
    const CellArrays cells = RandomGroup(sampler);
    const Eigen::Vector3d view(sampler.Between(-4, 4), sampler.Between(-4, 4),
                               sampler.Between(-2, 2));
    const PairBounds bounds = intervals.Bound({view, view}, CellBounds::Of(cells, 0, 1));
    EXPECT_NEAR(bounds.range.min, bounds.range.max, 1e-9);
    EXPECT_NEAR(bounds.facing.min, bounds.facing.max, 1e-9);
    EXPECT_NEAR(bounds.sin_elevation.min, bounds.sin_elevation.max, 1e-9);
    if (bounds.facing.min > 0 && bounds.range.min > 0.5 && bounds.range.max < 6) {
      EXPECT_NEAR(bounds.density.min, bounds.density.max, 1e-6 * bounds.density.max);
    }
  }
}

}  // namespace
}  // namespace vantage::planning
