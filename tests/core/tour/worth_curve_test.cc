#include "core/tour/worth_curve.h"

#include <gtest/gtest.h>

namespace vantage::tour {
namespace {

// Stations in a row, a minute apart, each linked to the next; station i has elements i and i + 1.
OrderProblem Row(uint32_t stations) {
  OrderProblem problem;
  for (uint32_t i = 0; i < stations; ++i) {
    problem.walk.emplace_back();
    problem.links.emplace_back();
    for (uint32_t j = 0; j < stations; ++j) {
      problem.walk[i].push_back(60.0 * std::abs(static_cast<double>(i) - j));
      if (i + 1 == j || j + 1 == i) problem.links[i].push_back(j);
    }
    problem.anchored.push_back(i == 0 ? 1 : 0);
    problem.storey.push_back(0);
  }
  problem.first = {std::vector<double>(stations, 0)};
  problem.speed = {60};
  problem.scan = {3};
  return problem;
}

TEST(WorthCurveTest, WhatBringsLeastIsLeftOutFirstUnlessOthersNeedIt) {
  const OrderProblem problem = Row(4);
  // 0: 4 m2 of its own; 1: nothing of its own, but 2 is aligned with it; 3: 1 m2.
  const std::vector<cover::ElementSet> covers = {{0b0011}, {0b0010}, {0b0110}, {0b1100}};
  const std::vector<double> weights = {4, 2, 3, 1};
  const auto curve = WorthCurve(problem, {{0, 1, 2, 3}}, covers, weights);
  ASSERT_EQ(curve.size(), 4u);
  EXPECT_EQ(curve[3].scans, 4u);
  EXPECT_DOUBLE_EQ(curve[3].area, 10);
  EXPECT_DOUBLE_EQ(curve[3].minutes, 4 * 3 + 3);
  EXPECT_DOUBLE_EQ(curve[2].area, 9);  // without 3
  EXPECT_DOUBLE_EQ(curve[2].minutes, 3 * 3 + 2);
  EXPECT_DOUBLE_EQ(curve[1].area, 6);  // without 2; only then without 1
  EXPECT_DOUBLE_EQ(curve[0].area, 6);
  EXPECT_DOUBLE_EQ(curve[0].minutes, 3);
}

TEST(WorthCurveTest, GoesDownFromAllThatIsBrought) {
  const OrderProblem problem = Row(6);
  std::vector<cover::ElementSet> covers;
  for (uint32_t i = 0; i < 6; ++i) covers.push_back({uint64_t{3} << i});
  const auto curve = WorthCurve(problem, {{0, 1, 2, 3, 4, 5}}, covers, std::vector<double>(7, 1));
  ASSERT_EQ(curve.size(), 6u);
  for (size_t k = 1; k < curve.size(); ++k) EXPECT_LE(curve[k - 1].area, curve[k].area);
  EXPECT_DOUBLE_EQ(curve.back().area, 7);
}

}  // namespace
}  // namespace vantage::tour
