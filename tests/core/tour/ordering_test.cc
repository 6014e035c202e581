#include "core/tour/ordering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vantage::tour {
namespace {

struct Drawn {
  OrderProblem problem;
  std::vector<std::pair<double, double>> places;  // m
};

// Stations on a square of `edge` m, linked where they are near; `anchored` of them from the first
// on, by their distance from the corner where all scanners stand.
Drawn Draw(uint64_t seed, size_t stations, size_t scanners, double edge, double linked_within,
           size_t anchored) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double high) {
    return high * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  Drawn drawn;
  for (size_t i = 0; i < stations; ++i) {
    const double x = uniform(edge);
    const double y = uniform(edge);
    drawn.places.emplace_back(x, y);
  }
  std::sort(drawn.places.begin(), drawn.places.end(), [](const auto& a, const auto& b) {
    return std::hypot(a.first, a.second) < std::hypot(b.first, b.second);
  });
  OrderProblem& problem = drawn.problem;
  const auto apart = [&](const auto& a, const auto& b) {
    return std::hypot(a.first - b.first, a.second - b.second);
  };
  for (size_t i = 0; i < stations; ++i) {
    problem.walk.emplace_back();
    problem.links.emplace_back();
    for (uint32_t j = 0; j < stations; ++j) {
      const double length = apart(drawn.places[i], drawn.places[j]);
      problem.walk[i].push_back(length);
      if (j != i && length < linked_within) problem.links[i].push_back(j);
    }
    problem.anchored.push_back(i < anchored ? 1 : 0);
    problem.storey.push_back(0);
  }
  for (size_t s = 0; s < scanners; ++s) {
    problem.first.emplace_back();
    for (const auto& place : drawn.places) {
      problem.first[s].push_back(std::hypot(place.first, place.second));
    }
    problem.speed.push_back(60);
    problem.scan.push_back(3);
  }
  return drawn;
}

// Each station once.
void ExpectAll(const Routes& routes, size_t stations) {
  std::vector<uint32_t> all;
  for (const auto& route : routes) all.insert(all.end(), route.begin(), route.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), stations);
  for (uint32_t i = 0; i < stations; ++i) EXPECT_EQ(all[i], i);
}

// The rule itself, without the clockwork: who comes when, one scan after the other.
bool Registers(const OrderProblem& problem, const Routes& routes, const Timetable& table) {
  bool any_anchored = false;
  for (const uint8_t anchored : problem.anchored) any_anchored = any_anchored || anchored != 0;
  double earliest = kNoWay;
  for (const double start : table.start) earliest = std::min(earliest, start);
  size_t roots = 0;
  for (size_t s = 0; s < routes.size(); ++s) {
    for (const uint32_t at : routes[s]) {
      bool holds = problem.anchored[at] != 0;
      for (const uint32_t other : problem.links[at]) {
        holds = holds || table.end[other] <= table.start[at] + 1e-9;
      }
      if (!holds && !any_anchored && table.start[at] == earliest) {
        ++roots;
        holds = true;
      }
      if (!holds) return false;
    }
  }
  return roots <= 1;
}

TEST(OrderingTest, OfOneScannerItIsTheShortestThatRegisters) {
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const Drawn drawn = Draw(seed, 7, 1, 20, 12, seed % 3);
    double least = kNoWay;
    Routes order = {{0, 1, 2, 3, 4, 5, 6}};
    do {
      least = std::min(least, CostOf(drawn.problem, order));
    } while (std::next_permutation(order[0].begin(), order[0].end()));
    const Routes routes = OrderStations(drawn.problem, 1000, 1, parallel::Budget::Unlimited());
    ExpectAll(routes, 7);
    // Where they do not hang together, whatever the order, the search is by chance.
    EXPECT_NEAR(CostOf(drawn.problem, routes), least, least >= 1000 ? 0.1 : 1e-9) << seed;
    if (least >= 1000) continue;
    const Timetable table = TimetableOf(drawn.problem, routes);
    EXPECT_TRUE(table.possible);
    EXPECT_TRUE(Registers(drawn.problem, routes, table)) << seed;
  }
}

TEST(OrderingTest, OfTwoScannersItIsTheBestOfAllOrders) {
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const Drawn drawn = Draw(seed, 6, 2, 30, 20, 1 + seed % 2);
    double least = kNoWay;
    std::vector<uint32_t> order = {0, 1, 2, 3, 4, 5};
    do {
      for (size_t cut = 0; cut <= order.size(); ++cut) {
        const auto middle = order.begin() + static_cast<ptrdiff_t>(cut);
        least = std::min(least,
                         CostOf(drawn.problem, {{order.begin(), middle}, {middle, order.end()}}));
      }
    } while (std::next_permutation(order.begin(), order.end()));
    const Routes routes = OrderStations(drawn.problem, 20000, 1, parallel::Budget::Unlimited());
    ExpectAll(routes, 6);
    EXPECT_NEAR(CostOf(drawn.problem, routes), least, 0.01 * least) << seed;
  }
}

TEST(OrderingTest, WaitsForTheScanThatItIsAlignedWith) {
  // A chain; the second scanner stands beside the end of it.
  Drawn drawn = Draw(1, 3, 2, 10, 0, 1);
  OrderProblem& problem = drawn.problem;
  problem.links = {{1}, {0, 2}, {1}};
  for (auto& row : problem.walk) row.assign(3, 60);  // a minute
  problem.first = {{0, 60, 60}, {60, 60, 0}};
  const Timetable table = TimetableOf(problem, {{0, 1}, {2}});
  EXPECT_TRUE(table.possible);
  EXPECT_DOUBLE_EQ(table.end[0], 3);
  EXPECT_DOUBLE_EQ(table.start[1], 4);
  EXPECT_DOUBLE_EQ(table.end[1], 7);
  EXPECT_DOUBLE_EQ(table.start[2], 7);
  EXPECT_DOUBLE_EQ(table.wait[2], 7);
  EXPECT_DOUBLE_EQ(table.minutes, 10);
  // Each waits for the other: never.
  EXPECT_FALSE(TimetableOf(problem, {{2, 0}, {1}}).possible);
}

TEST(OrderingTest, BeforeTheFirstScanOneOfThemIsFirst) {
  const Drawn drawn = Draw(3, 6, 2, 10, 9, 0);
  const Routes routes = OrderStations(drawn.problem, 5000, 1, parallel::Budget::Unlimited());
  const Timetable table = TimetableOf(drawn.problem, routes);
  EXPECT_TRUE(table.possible);
  EXPECT_TRUE(Registers(drawn.problem, routes, table));
}

TEST(OrderingTest, StoreysAreDoneOneAfterTheOther) {
  Drawn drawn = Draw(5, 24, 1, 20, 60, 24);
  for (size_t i = 0; i < 24; ++i) drawn.problem.storey[i] = static_cast<int>(i % 2);
  const Routes routes = OrderStations(drawn.problem, 100000, 1, parallel::Budget::Unlimited());
  int changes = 0;
  for (size_t k = 1; k < routes[0].size(); ++k) {
    changes += drawn.problem.storey[routes[0][k]] != drawn.problem.storey[routes[0][k - 1]];
  }
  EXPECT_EQ(changes, 1);
}

TEST(OrderingTest, RoomsAreEnteredWithinTheirHours) {
  Drawn drawn = Draw(7, 6, 1, 5, 60, 6);
  drawn.problem.hours.assign(6, {});
  drawn.problem.hours[0] = {10, 14};  // the nearest
  drawn.problem.hours[5] = {0, 4};    // the farthest
  const Routes routes = OrderStations(drawn.problem, 20000, 1, parallel::Budget::Unlimited());
  const Timetable table = TimetableOf(drawn.problem, routes);
  EXPECT_TRUE(table.possible);
  EXPECT_GE(table.start[0], 10);
  EXPECT_LE(table.end[0], 14);
  EXPECT_LE(table.end[5], 4);
}

TEST(OrderingTest, WhoMayNotStandThereDoesNotGo) {
  Drawn drawn = Draw(9, 8, 2, 10, 60, 8);
  drawn.problem.may = {{1, 1, 1, 1, 0, 0, 0, 0}, {0, 0, 0, 0, 1, 1, 1, 1}};
  const Routes routes = OrderStations(drawn.problem, 20000, 1, parallel::Budget::Unlimited());
  EXPECT_TRUE(TimetableOf(drawn.problem, routes).possible);
  for (const uint32_t at : routes[0]) EXPECT_LT(at, 4u);
  for (const uint32_t at : routes[1]) EXPECT_GE(at, 4u);
}

// Of a scanner's stations, the share of whose nearest neighbours are its own.
double Together(const OrderProblem& problem, const Routes& routes) {
  std::vector<size_t> of(problem.stations());
  for (size_t s = 0; s < routes.size(); ++s) {
    for (const uint32_t at : routes[s]) of[at] = s;
  }
  double own = 0;
  for (uint32_t i = 0; i < of.size(); ++i) {
    uint32_t nearest = i == 0 ? 1 : 0;
    for (uint32_t j = 0; j < of.size(); ++j) {
      if (j != i && problem.walk[i][j] < problem.walk[i][nearest]) nearest = j;
    }
    own += of[i] == of[nearest];
  }
  return own / static_cast<double>(of.size());
}

TEST(OrderingTest, FourScannersHaveZonesAndAreDoneTogether) {
  constexpr int kSites = 4;
  double together = 0;
  for (uint64_t seed = 11; seed < 11 + kSites; ++seed) {
    const Drawn drawn = Draw(seed, 40, 4, 40, 16, 3);
    const Routes routes = OrderStations(drawn.problem, 300000, 1, parallel::Budget::Unlimited());
    ExpectAll(routes, 40);
    const Timetable table = TimetableOf(drawn.problem, routes);
    EXPECT_TRUE(table.possible);
    EXPECT_TRUE(Registers(drawn.problem, routes, table));
    const auto [least, most] = std::minmax_element(table.done.begin(), table.done.end());
    EXPECT_GT(*least, 0.75 * *most);
    // Ten scans each, and what they walk and wait.
    EXPECT_LT(table.minutes, 1.35 * 30);
    together += Together(drawn.problem, routes) / kSites;
  }
  // Without a price on borders it is 0.6.
  EXPECT_GT(together, 0.82);
}

// A scan of 1.85 minutes, with setting up: what an instrument takes at its middle setting.
TEST(OrderingTest, NobodyIsLeftWithoutWorkWhereScansAreShort) {
  for (const size_t stations : {2, 3, 4}) {
    SCOPED_TRACE(stations);
    Drawn drawn = Draw(21, stations, 2, 6, 20, stations);
    drawn.problem.scan.assign(2, 1.85);
    const Routes routes = OrderStations(drawn.problem, 5000, 1, parallel::Budget::Unlimited());
    ExpectAll(routes, stations);
    for (const std::vector<uint32_t>& route : routes) EXPECT_FALSE(route.empty());
  }
}

TEST(OrderingTest, TheSameEveryTimeAndNeverWorseThanWhatItBeganWith) {
  const Drawn drawn = Draw(13, 25, 2, 40, 15, 2);
  const auto once = OrderStations(drawn.problem, 3000, 7, parallel::Budget::Unlimited());
  EXPECT_EQ(once, OrderStations(drawn.problem, 3000, 7, parallel::Budget::Unlimited()));
  const auto more = OrderStations(drawn.problem, 20000, 8, parallel::Budget::Unlimited(), once);
  EXPECT_LE(CostOf(drawn.problem, more), CostOf(drawn.problem, once) + 1e-9);
}

}  // namespace
}  // namespace vantage::tour
