// Residuals with errors of known size, and what is learned of them.
#include "core/registration/align/instrument_residuals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

constexpr double kSheetShared = 0.002;  // m
constexpr double kSheetNoise = 0.003;   // m

struct Errors {
  double shared = 0;  // m, one sigma, of a block
  double white = 0;   // m, of a sample
};

constexpr double kSide = 0.5;  // m, of a block

// A pair with so many blocks of 30 samples at 3 m and head on, and as many at 12 m and 65 degrees.
// None lies beside another.
PairResiduals Pair(size_t blocks, const Errors& near, const Errors& far, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  std::vector<ClassedResidual> residuals;
  for (size_t block = 0; block < 2 * blocks; ++block) {
    const bool is_near = block % 2 == 0;
    const Errors& errors = is_near ? near : far;
    const double shared = errors.shared * gauss(random);
    for (int i = 0; i < 30; ++i) {
      residuals.push_back({{3 * kSide * static_cast<double>(block) + 0.01 * i, 0.1, 0.1},
                           Eigen::Vector3d::UnitZ(),
                           is_near ? 3.0 : 12.0,
                           std::cos(sensor::Radians(is_near ? 10 : 65)),
                           shared + errors.white * gauss(random),
                           kSheetNoise * kSheetNoise});
    }
  }
  return SumResiduals(residuals, kSide);
}

const size_t kNear = ResidualClass(3, std::cos(sensor::Radians(10)));
const size_t kFar = ResidualClass(12, std::cos(sensor::Radians(65)));

TEST(InstrumentResiduals, ClassesEndWhereTheySay) {
  EXPECT_EQ(ResidualClass(0.5, 1), 0u);
  EXPECT_EQ(ResidualClass(1.99, std::cos(sensor::Radians(39))), 0u);
  EXPECT_EQ(ResidualClass(1.99, std::cos(sensor::Radians(41))), 1u);
  EXPECT_EQ(ResidualClass(2.01, std::cos(sensor::Radians(61))), 6u);
  EXPECT_EQ(ResidualClass(500, 0), kResidualClasses - 1);
}

TEST(InstrumentResiduals, ErrorsAsOnTheSheetAddNothing) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    InstrumentResiduals shown;
    shown.Add(Pair(100, {0.001, 0.8 * kSheetNoise}, {0.001, 0.8 * kSheetNoise}, seed));
    EXPECT_FALSE(shown.Excess(kSheetShared).any) << "seed " << seed;
  }
}

TEST(InstrumentResiduals, FindErrorsOfKnownSizeByRangeAndIncidence) {
  // 6 mm near, 15 mm far; twice the noise far.
  InstrumentResiduals shown;
  for (unsigned seed = 0; seed < 20; ++seed) {
    shown.Add(Pair(250, {0.006, kSheetNoise}, {0.015, 2 * kSheetNoise}, seed));
  }
  const InstrumentExcess excess = shown.Excess(kSheetShared);
  // One in a hundred comes from the prior weights of 40 blocks beside 5,000 (twice: towards all
  // classes, towards the sheet); the draw of 5,000 blocks is 2 %.
  const auto beyond = [](double sigma) { return sigma * sigma - kSheetShared * kSheetShared; };
  EXPECT_NEAR(excess.shared[kNear] / beyond(0.006), 1, 0.12);
  EXPECT_NEAR(excess.shared[kFar] / beyond(0.015), 1, 0.08);
  EXPECT_NEAR(std::sqrt(excess.scatter[kFar]), std::sqrt(3.0) * kSheetNoise, 0.0002);
  EXPECT_LT(std::sqrt(excess.scatter[kNear]), 0.0006);
  // Where nothing was measured: what all show.
  const double all = (beyond(0.006) + beyond(0.015)) / 2;
  EXPECT_NEAR(excess.shared[ResidualClass(1, 1)] / all, 1, 0.05);
}

// A floor of 12 x 12 m on which errors are the same in cells of `cell`, one sigma `shared`: what
// they add up to over a large piece, by its blocks, is shared^2 (cell / side)^2 for each.
double SharedOnAFloor(double cell, double shared, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  const auto cells = static_cast<size_t>(std::lround(12 / cell));
  std::vector<double> field(cells * cells);
  for (double& value : field) value = shared * gauss(random);
  std::vector<ClassedResidual> residuals;
  for (double x = 0.025; x < 12; x += 0.1) {
    for (double y = 0.025; y < 12; y += 0.1) {
      const auto at = static_cast<size_t>(x / cell) * cells + static_cast<size_t>(y / cell);
      residuals.push_back({{x, y, 0.2},
                           Eigen::Vector3d::UnitZ(),
                           3.0,
                           1.0,
                           field[at] + kSheetNoise * gauss(random),
                           kSheetNoise * kSheetNoise});
    }
  }
  const PairResiduals pair = SumResiduals(residuals, kSide);
  const ClassResiduals& of = pair[ResidualClass(3, 1)];
  return of.shared / of.blocks;
}

TEST(InstrumentResiduals, ErrorsThatAreSharedFartherThanABlockCountAsSuch) {
  for (const double cell : {0.5, 1.0, 2.0}) {
    double sum = 0;
    constexpr int kFloors = 40;
    for (unsigned seed = 0; seed < kFloors; ++seed) sum += SharedOnAFloor(cell, 0.004, seed);
    const double expected = 0.004 * 0.004 * (cell / kSide) * (cell / kSide);
    // Cells of 2 m are four blocks of a metre, of which those beside count half and that across the
    // corner a quarter. Six modes that no alignment has taken here are made up for, and one sigma
    // of chance is taken off.
    const double counted = cell > 1 ? 2.25 / 4 : 1;
    EXPECT_NEAR(std::sqrt(sum / kFloors / (counted * expected)), 1.0, 0.15) << cell;
  }
}

TEST(InstrumentResiduals, WhiteNoiseDoesNotHangTogether) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    EXPECT_LT(SharedOnAFloor(0.5, 0, seed), kSheetShared * kSheetShared) << seed;
  }
}

TEST(InstrumentResiduals, AreBelievedLessWhileThereIsLittle) {
  // Without any draw: every block is off by 10 mm, up or down.
  for (const double blocks : {30.0, 60.0, 120.0, 600.0, 6000.0}) {
    PairResiduals pair{};
    pair[kNear] = {blocks, blocks * 1e-4, 29 * blocks, 0, 0};
    InstrumentResiduals shown;
    shown.Add(pair);
    const double beyond = 1e-4 - kSheetShared * kSheetShared;
    EXPECT_NEAR(shown.Excess(kSheetShared).shared[kNear], beyond * blocks / (blocks + kPriorBlocks),
                1e-12);
  }
}

TEST(InstrumentResiduals, AFewPiecesOfSurfaceSayNothing) {
  InstrumentResiduals shown;
  shown.Add(Pair(10, {0.05, 0.05}, {0.05, 0.05}, 1));
  EXPECT_TRUE(shown.empty());
  EXPECT_FALSE(shown.Excess(kSheetShared).any);
}

TEST(InstrumentResiduals, AreTheSameInAnyOrder) {
  std::vector<PairResiduals> pairs;
  for (unsigned seed = 0; seed < 7; ++seed) {
    pairs.push_back(Pair(40 + 10 * seed, {0.004, 0.003}, {0.009, 0.004}, seed));
  }
  const InstrumentResiduals once = InstrumentResiduals::Of(pairs);
  std::mt19937_64 random(5);
  for (int k = 0; k < 50; ++k) {
    std::shuffle(pairs.begin(), pairs.end(), random);
    const InstrumentResiduals again = InstrumentResiduals::Of(pairs);
    ASSERT_EQ(again.scans(), once.scans());
    for (size_t i = 0; i < kResidualClasses; ++i) ASSERT_EQ(again.sums()[i], once.sums()[i]);
  }
}

}  // namespace
}  // namespace vantage::registration
