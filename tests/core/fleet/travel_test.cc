#include "core/fleet/travel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <queue>
#include <random>

#include "core/parallel/parallel.h"
#include "core/planning/feasibility/floor_pieces.h"
#include "core/visibility/opaque_grid.h"
#include "tests/support/closed_form_view.h"

namespace vantage::fleet {
namespace {

using Eigen::Vector3d;

constexpr double kCell = 0.1;

// A floor of nx x ny columns from the origin, m.
WalkGrid Floor(int nx, int ny, const std::function<float(int, int)>& height) {
  WalkGrid grid;
  grid.nodes = planning::FloorNodes({0, 0}, {nx, ny}, kCell);
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) grid.nodes.AddColumn({height(x, y)});
  }
  grid.passable.assign(static_cast<size_t>(nx * ny), 1);
  return grid;
}
WalkGrid Flat(int nx, int ny) {
  return Floor(nx, ny, [](int, int) { return 0.0f; });
}

// The first of a column.
uint32_t NodeOf(const WalkGrid& grid, const Eigen::Vector2i& c) { return grid.nodes.In(c).first; }

Vector3d CentreOf(const WalkGrid& grid, const Eigen::Vector2i& c) {
  return {(c.x() + 0.5) * grid.nodes.cell_size(), (c.y() + 0.5) * grid.nodes.cell_size(), 1.5};
}

void Block(WalkGrid& grid, int x0, int y0, int x1, int y1) {
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) grid.passable[NodeOf(grid, {x, y})] = 0;
  }
}

TEST(TravelTest, RunsStraightWhereNothingIsInTheWay) {
  const WalkGrid grid = Flat(80, 50);
  const Vector3d from = CentreOf(grid, {3, 4});
  const TravelMap map(grid, from);
  for (const Eigen::Vector2i& to :
       {Eigen::Vector2i(3, 4), Eigen::Vector2i(70, 4), Eigen::Vector2i(3, 45),
        Eigen::Vector2i(60, 17), Eigen::Vector2i(79, 49)}) {
    const auto length = map.Length(CentreOf(grid, to));
    ASSERT_TRUE(length.has_value());
    EXPECT_NEAR(*length, (CentreOf(grid, to) - from).head<2>().norm(), 1e-4) << to.transpose();
  }
}

TEST(TravelTest, BendsAroundACornerAsARopeDoes) {
  WalkGrid grid = Flat(100, 100);
  Block(grid, 0, 40, 60, 60);  // a wall from the left, free from column 60 on
  const Vector3d from = CentreOf(grid, {10, 20});
  const Vector3d to = CentreOf(grid, {10, 80});
  const TravelMap map(grid, from);
  // The way passes in the middle of the columns beside the wall's two corners.
  const Vector3d below = CentreOf(grid, {60, 39});
  const Vector3d above = CentreOf(grid, {60, 60});
  const double rope = (below - from).norm() + (above - below).norm() + (to - above).norm();
  const auto length = map.Length(to);
  ASSERT_TRUE(length.has_value());
  EXPECT_NEAR(*length, rope, 0.01 * rope);
  const std::vector<Vector3d> way = map.Way(to);
  ASSERT_GE(way.size(), 3u);
  double along = 0;
  for (size_t i = 1; i < way.size(); ++i) along += (way[i] - way[i - 1]).head<2>().norm();
  EXPECT_NEAR(along, *length, 1e-3);
}

TEST(TravelTest, SaysWhereThereIsNoWay) {
  WalkGrid grid = Flat(40, 40);
  Block(grid, 20, 0, 22, 40);
  const TravelMap map(grid, CentreOf(grid, {5, 5}));
  EXPECT_FALSE(map.Length(CentreOf(grid, {30, 5})).has_value());
  EXPECT_TRUE(map.Way(CentreOf(grid, {30, 5})).empty());
  EXPECT_FALSE(map.Length({-3, 0, 0}).has_value());
  EXPECT_FALSE(map.Length(CentreOf(grid, {20, 5})).has_value());
  const TravelMap outside(grid, {-3, 0, 0});
  EXPECT_FALSE(outside.known());
  EXPECT_FALSE(outside.Length(CentreOf(grid, {5, 5})).has_value());
}

TEST(TravelTest, ClimbsNoHigherThanAStep) {
  const auto raised = [&](float height) {
    const WalkGrid grid = Floor(40, 10, [&](int x, int) { return x < 20 ? 0.0f : height; });
    return TravelMap(grid, CentreOf(grid, {5, 5})).Length(CentreOf(grid, {30, 5})).has_value();
  };
  EXPECT_TRUE(raised(static_cast<float>(planning::kMaxStep) - 0.01f));
  EXPECT_FALSE(raised(static_cast<float>(planning::kMaxStep) + 0.01f));
}

// A ramp along x leads up to a floor over the one that it began on.
TEST(TravelTest, LeadsFromStoreyToStoreyByTheRamp) {
  WalkGrid grid;
  grid.nodes = planning::FloorNodes({0, 0}, {40, 20}, kCell);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 40; ++x) {
      const float ramp = 3.0f * static_cast<float>(x - 10) / 20;
      if (y < 10) {
        grid.nodes.AddColumn({0, 3});
      } else if (x < 10) {
        grid.nodes.AddColumn({0});
      } else {
        grid.nodes.AddColumn({std::min(3.0f, ramp)});
      }
    }
  }
  grid.passable.assign(grid.nodes.count(), 1);
  const TravelMap map(grid, CentreOf(grid, {2, 2}));
  const Vector3d below = CentreOf(grid, {20, 2});
  const Vector3d above = below + Vector3d(0, 0, 3);
  ASSERT_TRUE(map.Length(below).has_value());
  EXPECT_NEAR(*map.Length(below), 1.8, 1e-4);
  ASSERT_TRUE(map.Length(above).has_value());
  // Over to the ramp, up to column 29 where the storey can be stepped on, and back.
  EXPECT_GT(*map.Length(above), 3.2);
  EXPECT_LT(*map.Length(above), 5.5);
  const std::vector<Vector3d> way = map.Way(above);
  EXPECT_EQ(way.front().z(), 0);
  EXPECT_EQ(way.back().z(), 3);
  const TravelMap back(grid, above);
  EXPECT_NEAR(back.Length(CentreOf(grid, {2, 2})).value_or(0), *map.Length(above), 0.1);
}

TEST(TravelTest, AScannerThatDoesNotFitWhereItStandsGetsOutOfThatColumnOnly) {
  WalkGrid grid = Flat(20, 20);
  const auto gets_out = [&] {
    return TravelMap(grid, CentreOf(grid, {5, 5})).Length(CentreOf(grid, {15, 15})).has_value();
  };
  Block(grid, 5, 5, 6, 6);
  EXPECT_TRUE(gets_out());
  Block(grid, 4, 4, 7, 7);
  EXPECT_FALSE(gets_out());
}

// Shortest ways along the eight directions: at most 8.24 % longer than the shortest there is.
std::vector<double> EightWays(const WalkGrid& grid, const Eigen::Vector2i& from) {
  std::vector<double> length(grid.passable.size(), 1e9);
  std::priority_queue<std::pair<double, size_t>> queue;
  length[NodeOf(grid, from)] = 0;
  queue.emplace(0, NodeOf(grid, from));
  while (!queue.empty()) {
    const auto [negative, at] = queue.top();
    queue.pop();
    if (-negative > length[at]) continue;
    const int x = static_cast<int>(at) % grid.nodes.size().x();
    const int y = static_cast<int>(at) / grid.nodes.size().x();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector2i c(x + dx, y + dy);
        if (!grid.nodes.Inside(c) || grid.passable[NodeOf(grid, c)] == 0) continue;
        const double to = length[at] + kCell * std::hypot(dx, dy);
        if (to >= length[NodeOf(grid, c)] - 1e-12) continue;
        length[NodeOf(grid, c)] = to;
        queue.emplace(-to, NodeOf(grid, c));
      }
    }
  }
  return length;
}

TEST(TravelTest, LiesBetweenTheStraightLineAndWaysAlongTheGrid) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto draw = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    WalkGrid grid = Flat(60, 60);
    for (int k = 0; k < 40; ++k) {
      const int x = draw(55);
      const int y = draw(55);
      Block(grid, x, y, x + 1 + draw(5), y + 1 + draw(5));
    }
    grid.passable[0] = 1;
    const Vector3d start = CentreOf(grid, {0, 0});
    const std::vector<double> eight = EightWays(grid, {0, 0});
    const TravelMap map(grid, start);
    int reached = 0;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        const auto length = map.Length(CentreOf(grid, {x, y}));
        const double along = eight[NodeOf(grid, {x, y})];
        ASSERT_EQ(length.has_value(), along < 1e9) << x << ' ' << y;
        if (!length.has_value()) continue;
        ++reached;
        ASSERT_GE(*length, (CentreOf(grid, {x, y}) - start).head<2>().norm() - 1e-4);
        ASSERT_LE(*length, along + 1e-4) << x << ' ' << y;
        ASSERT_GE(*length, along / 1.0824 - 1e-4) << x << ' ' << y;
        // The way to one place alone is the same.
        if (reached % 100 == 0) {
          const Vector3d to = CentreOf(grid, {x, y});
          const TravelMap alone = TravelMap::To(grid, start, to);
          EXPECT_EQ(alone.Length(to), length);
          EXPECT_EQ(alone.Way(to), map.Way(to));
        }
      }
    }
    EXPECT_GT(reached, 1000);
  }
}

TEST(TravelTest, FootprintAndReachAreInTheGridOfAModel) {
  // Two rooms of 3 x 4 m joined by a doorway of 0.9 m, with a station in the first.
  test_support::ClosedFormScene scene;
  scene.extent = Eigen::AlignedBox3d(Vector3d(-0.1, -0.1, -0.1), Vector3d(6.2, 4.1, 2.8));
  scene.solid = [](const Vector3d& p) {
    const bool inside =
        p.x() > 0 && p.x() < 6.1 && p.y() > 0 && p.y() < 4 && p.z() > 0 && p.z() < 2.7;
    const bool wall = p.x() > 3 && p.x() < 3.1 && (p.y() < 1.5 || p.y() > 2.4 || p.z() > 2);
    return !inside || wall;
  };
  scene.stations = {test_support::MakeStation({1.0, 0.8, 1.5})};
  const model::PlanningView model = test_support::BuildView(scene);
  const visibility::OpaqueGrid grid(model);
  parallel::Serial serial;
  const auto length = [&](double width, const std::vector<Eigen::AlignedBox3d>& reach) {
    planning::PlanningConfig config;
    config.scanner_width = width;
    const planning::FeasibleViews feasible =
        planning::FeasibleViews::Find(model, grid, sensor::ScannerModel(), config, serial).value();
    return TravelMap(WalkGridOf(feasible, reach), scene.stations[0].position)
        .Length({5.0, 0.8, 1.5});
  };
  const auto open = length(0.6, {});
  ASSERT_TRUE(open.has_value());
  // Around the doorway's lower post, at half a footprint from it.
  const Eigen::Vector2d post(3.0, 1.5);
  const double rope = 2 * (Eigen::Vector2d(1.0, 0.8) - post).norm();
  EXPECT_GT(*open, rope);
  EXPECT_LT(*open, rope + 2 * 0.6);
  EXPECT_FALSE(length(1.2, {}).has_value()) << "wider than the doorway";
  const Eigen::AlignedBox3d first(Vector3d(0, 0, 0), Vector3d(3, 4, 2.7));
  EXPECT_FALSE(length(0.6, {first}).has_value());
  const Eigen::AlignedBox3d second(Vector3d(2.9, 0, 0), Vector3d(6.1, 4, 2.7));
  EXPECT_NEAR(length(0.6, {first, second}).value_or(0), *open, 1e-3);
}

}  // namespace
}  // namespace vantage::fleet
