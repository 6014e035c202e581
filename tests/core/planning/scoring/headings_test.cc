#include "core/planning/scoring/headings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/sector_oracle.h"

namespace vantage::planning {
namespace {

sensor::ScannerModel WithSpan(double degrees) {
  sensor::ScannerModel scanner;
  scanner.azimuth_span = sensor::Radians(degrees);
  return scanner;
}

TEST(HeadingsTest, WhoTurnsAllAroundHasOneThatSeesEverything) {
  const Headings headings(sensor::ScannerModel{});
  EXPECT_TRUE(headings.all_around());
  EXPECT_EQ(headings.size(), 1u);
  EXPECT_EQ(headings.bins(), 1u);
  EXPECT_TRUE(headings.Sees(0, headings.BinOf(-1, 0.3F)));
}

TEST(HeadingsTest, LieCloseTogether) {
  for (const double span : {3.0, 20.0, 47.5, 90.0, 120.0, 270.0, 359.0}) {
    const Headings headings(WithSpan(span));
    EXPECT_FALSE(headings.all_around());
    EXPECT_NEAR(headings.step() * static_cast<double>(headings.size()), 2 * sensor::kPi, 1e-9);
    EXPECT_LE(headings.step(), sensor::Radians(5) + 1e-9);
    EXPECT_LE(headings.step(), sensor::Radians(span) / 3 + 1e-9);
  }
}

// Directions at random, spans that are whole numbers of steps and others: a bin is seen exactly
// when its directions are.
TEST(HeadingsTest, BinsAreSeenWhenTheirDirectionsAre) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-sensor::kPi, sensor::kPi);
  for (const double span : {3.0, 20.0, 47.5, 90.0, 120.0, 270.0, 359.0}) {
    for (const double first : {0.0, 1.234, -2.5}) {
      const Headings headings(WithSpan(span), first);
      for (int k = 0; k < 2000; ++k) {
        const double azimuth = any(random);
        const size_t bin = headings.BinOf(static_cast<float>(2 * std::cos(azimuth)),
                                          static_cast<float>(2 * std::sin(azimuth)));
        ASSERT_LT(bin, headings.bins());
        for (size_t i = 0; i < headings.size(); ++i) {
          const double off =
              std::abs(std::remainder(azimuth - headings.Angle(i), 2 * sensor::kPi)) -
              sensor::Radians(span) / 2;
          if (std::abs(off) < 1e-6) continue;
          ASSERT_EQ(headings.Sees(i, bin), off < 0)
              << span << " degrees, azimuth " << azimuth << ", heading " << headings.Angle(i);
        }
      }
    }
  }
}

TEST(HeadingsTest, SumsAreThoseOfTheBinsSeen) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(0, 1);
  for (const double span : {3.0, 47.5, 120.0, 359.0}) {
    const Headings headings(WithSpan(span));
    std::vector<double> by_bin(headings.bins());
    for (double& value : by_bin) value = any(random);
    std::vector<double> by_heading(headings.size());
    headings.Sum(by_bin, by_heading);
    for (size_t i = 0; i < headings.size(); ++i) {
      double sum = 0;
      for (size_t bin = 0; bin < by_bin.size(); ++bin) {
        if (headings.Sees(i, bin)) sum += by_bin[bin];
      }
      EXPECT_NEAR(by_heading[i], sum, 1e-12 * static_cast<double>(by_bin.size()));
    }
    EXPECT_EQ(BestOf(by_heading).score, *std::max_element(by_heading.begin(), by_heading.end()));
  }
}

TEST(HeadingsTest, WhatABoxMayShowIsNeverLeftOut) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-4, 4);
  std::uniform_real_distribution<double> side(0.01, 2);
  std::uniform_real_distribution<double> unit(0, 1);
  size_t left_out = 0;
  for (const double span : {20.0, 120.0}) {
    const Headings headings(WithSpan(span));
    for (int k = 0; k < 300; ++k) {
      const Eigen::Vector2d low(place(random), place(random));
      const Eigen::AlignedBox2d box(
          low, Eigen::Vector2d(low.x() + side(random), low.y() + side(random)));
      std::vector<double> by_heading(headings.size(), 0);
      headings.AddWhereSeen(box, 1, by_heading);
      for (int n = 0; n < 50; ++n) {
        const Eigen::Vector2d at =
            box.min() + Eigen::Vector2d(unit(random), unit(random)).cwiseProduct(box.sizes());
        const size_t bin = headings.BinOf(static_cast<float>(at.x()), static_cast<float>(at.y()));
        for (size_t i = 0; i < headings.size(); ++i) {
          ASSERT_TRUE(!headings.Sees(i, bin) || by_heading[i] == 1);
        }
      }
      for (const double value : by_heading) left_out += value == 0;
    }
  }
  EXPECT_GT(left_out, 1000u);  // the box is not taken for all around
}

TEST(SectorTest, OfOneOfTheHeadingsIsThatHeadingToTheBit) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> any(-1, 1);
  const sensor::ScannerModel scanner = WithSpan(75);
  const Headings headings(scanner);
  for (size_t i = 0; i < headings.size(); ++i) {
    for (const double turns : {0.0, 2 * sensor::kPi, -2 * sensor::kPi}) {
      const Sector sector(scanner, headings.Angle(i) + turns);
      for (int k = 0; k < 50; ++k) {
        const float x = any(random);
        const float y = any(random);
        ASSERT_EQ(sector.Sees(x, y), headings.Sees(i, headings.BinOf(x, y)));
      }
    }
  }
}

TEST(SectorTest, SeesHalfTheSpanOnEitherSideOfAnyHeading) {
  const sensor::ScannerModel scanner = WithSpan(100);
  for (double heading = -7; heading < 7; heading += 0.0317) {
    const Sector sector(scanner, heading);
    for (double off = -3.1; off < 3.1; off += 0.0613) {
      const double azimuth = heading + off;
      EXPECT_EQ(
          sector.Sees(static_cast<float>(std::cos(azimuth)), static_cast<float>(std::sin(azimuth))),
          std::abs(off) < sensor::Radians(50));
    }
  }
  EXPECT_TRUE(Sector(scanner, std::nullopt).everything());
  EXPECT_TRUE(Sector(sensor::ScannerModel{}, 1.0).everything());
}

// One ray to each cell, all headings: against each heading's own sum.
TEST(HeadingsTest, OneEvaluationScoresAllHeadings) {
  for (const double span : {33.0, 120.0, 300.0}) {
    PlanningConfig config;
    config.viewcell_size = 0.4;
    const test_support::PlanningProblem problem(
        std::make_shared<model::PlanningView>(
            test_support::BuildView(test_support::FurnishedRoom(6))),
        config, WithSpan(span));
    const BruteForceScorer& scorer = problem.scoring->scorer();
    const CellArrays& cells = problem.scoring->cells();
    ASSERT_GT(problem.views.size(), 10u);
    for (size_t v = 0; v < problem.views.size(); v += 5) {
      std::vector<double> by_heading(scorer.headings().size());
      const ViewScore score =
          scorer.ScoreHeadings(problem.views[v], cells, parallel::Budget::Unlimited(), by_heading);
      EXPECT_EQ(score.rays,
                scorer.Score(problem.views[v], cells, parallel::Budget::Unlimited()).rays);
      double best = 0;
      const auto oracle = test_support::ScoreInSectors(scorer, cells, problem.views[v],
                                                       test_support::AnglesOf(scorer.headings()));
      for (size_t i = 0; i < by_heading.size(); ++i) {
        EXPECT_GE(by_heading[i], oracle[i].least * (1 - 1e-9));
        EXPECT_LE(by_heading[i], oracle[i].most * (1 + 1e-9));
        best = std::max(best, by_heading[i]);
      }
      EXPECT_EQ(score.score, best);
      EXPECT_EQ(by_heading[score.heading], best);
    }
  }
}

}  // namespace
}  // namespace vantage::planning
