// Compares interval bounds with values found by sampling.
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

// A box of views and a group of cells, and what the bounds say of all pairs of them.
struct BoundedPair {
  CellArrays cells;
  Eigen::AlignedBox3d views;
  PairBounds bounds;
  bool may = false;       // some pair may gain something
  uint8_t satisfied = 0;  // constraints that every pair satisfies

  bool Satisfied(uint8_t constraint) const { return (satisfied & constraint) != 0; }
};

// One of them, looked at from the definitions.
struct LookedAt {
  double range = 0;    // m
  double facing = 0;   // m, range times the cosine of incidence
  double sine = 0;     // of the elevation
  double density = 0;  // samples / m^2; 0 where the scanner cannot measure
  double gain = 0;     // samples / m^2
  bool in_range = false;
  bool incident = false;
  bool in_view = false;
};

class IntervalConstraintsTest : public ::testing::Test {
 protected:
  static constexpr int kPairs = test_support::Runs(20000);
  static constexpr int kSamples = 60;  // of each: 1.2 million views and cells

  static sensor::ScannerModel Scanner() {
    sensor::ScannerModel scanner;
    scanner.range_max = 6;
    scanner.elevation_max = sensor::Radians(70);
    return scanner;
  }
  BoundedPair Draw() {
    BoundedPair pair;
    pair.cells = RandomGroup(sampler_);
    pair.views = RandomViews(sampler_);
    const CellBounds group = CellBounds::Of(pair.cells, 0, pair.cells.size());
    pair.bounds = intervals_.Bound(pair.views, group);
    Interval density;
    pair.may = intervals_.Test(pair.views, group, pair.satisfied, density);
    return pair;
  }
  // fn(LookedAt) for random views and cells of a pair.
  template <typename Fn>
  void Look(const BoundedPair& pair, Fn&& fn) {
    const CellArrays& cells = pair.cells;
    for (int k = 0; k < kSamples; ++k) {
      const Eigen::Vector3d view = sampler_.In(pair.views);
      const size_t i = sampler_.Bits() % cells.size();
      const Eigen::Vector3d p = Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]).cast<double>();
      const Eigen::Vector3d n =
          Eigen::Vector3f(cells.nx[i], cells.ny[i], cells.nz[i]).cast<double>();
      const Eigen::Vector3d d = p - view;
      LookedAt at;
      at.range = d.norm();
      if (at.range < 1e-3) continue;
      at.facing = -n.dot(d);
      at.sine = d.z() / at.range;
      at.in_range = at.range >= scanner_.range_min && at.range <= scanner_.range_max;
      at.incident = at.facing >= std::cos(scanner_.max_incidence) * at.range;
      at.in_view = at.sine >= std::sin(scanner_.elevation_min) &&
                   at.sine <= std::sin(scanner_.elevation_max);
      if (at.in_range && at.facing > 0) {
        at.density = scanner_.SamplingDensity(std::asin(std::clamp(at.sine, -1.0, 1.0)),
                                              at.facing / at.range, at.range);
      }
      at.gain = constraints_.AddedDensity(view, p, n, static_cast<double>(cells.q[i]),
                                          static_cast<double>(cells.enough[i]));
      fn(at);
    }
  }

  const sensor::ScannerModel scanner_ = Scanner();
  const SensingConstraints constraints_{scanner_};
  const IntervalConstraints intervals_{constraints_};
  Sampler sampler_{5};
};

TEST_F(IntervalConstraintsTest, BoundsContainEverySample) {
  constexpr double kMargin = 1e-9;
  for (int n = 0; n < kPairs; ++n) {
    const BoundedPair pair = Draw();
    const PairBounds& bounds = pair.bounds;
    const auto contains = [](const Interval& interval, double value) {
      return value >= interval.min - kMargin && value <= interval.max + kMargin;
    };
    Look(pair, [&](const LookedAt& at) {
      ASSERT_TRUE(contains(bounds.range, at.range)) << "pair " << n;
      ASSERT_TRUE(contains(bounds.facing, at.facing)) << "pair " << n;
      ASSERT_TRUE(contains(bounds.cos_incidence, at.facing / at.range)) << "pair " << n;
      ASSERT_TRUE(contains(bounds.sin_elevation, at.sine)) << "pair " << n;
      if (at.density == 0) return;
      ASSERT_GE(at.density, bounds.density.min * (1 - kMargin)) << "pair " << n;
      ASSERT_LE(at.density, bounds.density.max * (1 + kMargin)) << "pair " << n;
    });
    if (HasFatalFailure()) return;
  }
}

TEST_F(IntervalConstraintsTest, WhatIsSatisfiedIsSoForEverySample) {
  int decided = 0;
  for (int n = 0; n < kPairs; ++n) {
    const BoundedPair pair = Draw();
    decided += pair.satisfied == kSensingSatisfied ? 1 : 0;
    Look(pair, [&](const LookedAt& at) {
      ASSERT_TRUE(at.in_range || !pair.Satisfied(kRangeSatisfied)) << "pair " << n;
      ASSERT_TRUE(at.incident || !pair.Satisfied(kIncidenceSatisfied)) << "pair " << n;
      ASSERT_TRUE(at.in_view || !pair.Satisfied(kElevationSatisfied)) << "pair " << n;
    });
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(decided, kPairs / 50);  // or they say nothing
}

TEST_F(IntervalConstraintsTest, WhatIsRuledOutGainsNothing) {
  int ruled_out = 0;
  for (int n = 0; n < kPairs; ++n) {
    const BoundedPair pair = Draw();
    if (pair.may) continue;
    ++ruled_out;
    Look(pair, [&](const LookedAt& at) { ASSERT_EQ(at.gain, 0) << "pair " << n; });
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(ruled_out, kPairs / 4);
}

// Bounds that say nothing contain everything, too: those of the density are a few times as wide as
// what samples show of them.
TEST_F(IntervalConstraintsTest, BoundsOfTheDensityAreTight) {
  double tightness = 0;
  int tight = 0;
  for (int n = 0; n < kPairs; ++n) {
    const BoundedPair pair = Draw();
    const Interval& density = pair.bounds.density;
    if (pair.satisfied != kSensingSatisfied || density.max >= 1e7) continue;
    Interval sampled{1e30, -1e30};
    Look(pair, [&](const LookedAt& at) {
      sampled.min = std::min(sampled.min, at.density);
      sampled.max = std::max(sampled.max, at.density);
    });
    tightness += (sampled.max - sampled.min) / (density.max - density.min + 1e-9);
    ++tight;
  }
  ASSERT_GT(tight, kPairs / 100);
  EXPECT_GT(tightness / tight, 0.25);
}

TEST_F(IntervalConstraintsTest, PointsAreExact) {
  int measured = 0;
  for (int k = 0; k < 20000; ++k) {
    const CellArrays cells = RandomGroup(sampler_);
    const Eigen::Vector3d view(sampler_.Between(-4, 4), sampler_.Between(-4, 4),
                               sampler_.Between(-2, 2));
    const PairBounds bounds = intervals_.Bound({view, view}, CellBounds::Of(cells, 0, 1));
    EXPECT_NEAR(bounds.range.min, bounds.range.max, 1e-9);
    EXPECT_NEAR(bounds.facing.min, bounds.facing.max, 1e-9);
    EXPECT_NEAR(bounds.sin_elevation.min, bounds.sin_elevation.max, 1e-9);
    if (bounds.facing.min <= 0 || bounds.range.min <= 0.5 || bounds.range.max >= 6) continue;
    ++measured;
    EXPECT_NEAR(bounds.density.min, bounds.density.max, 1e-6 * bounds.density.max);
  }
  EXPECT_GT(measured, 1000);
}

}  // namespace
}  // namespace vantage::planning
