// Where a plan lies on paper.
#include "server/report/plan_sheet.h"

#include <gtest/gtest.h>

#include <numbers>

namespace vantage::report {
namespace {

// `columns` x `rows` cells of 10 cm, all floor.
model::FloorPlan FloorOf(int columns, int rows, double direction) {
  model::FloorPlan plan;
  plan.corner = {10, 20};
  plan.edge = 0.1;
  plan.columns = columns;
  plan.rows = rows;
  plan.cells.assign(static_cast<size_t>(columns) * rows, model::PlanCell::kFloor);
  plan.direction = direction;
  return plan;
}

TEST(PlanSheet, HasAScaleThatSurveyorsUse) {
  const PlanSheet sheet(FloorOf(100, 50, 0), {}, {180, 178});
  // 10.7 m with their margins: 1:50 would take 214 mm.
  EXPECT_EQ(sheet.scale(), 75);
  EXPECT_EQ(sheet.turn(), 0);
  EXPECT_FALSE(sheet.cut());
  EXPECT_LE(sheet.size().x(), 180);
  const Eigen::Vector2d along = sheet.ToSheet({12, 22}) - sheet.ToSheet({11, 22});
  EXPECT_NEAR(along.x(), 1000.0 / 75, 1e-9);
  EXPECT_NEAR(along.y(), 0, 1e-9);
  // y goes up on paper.
  EXPECT_LT(sheet.ToSheet({12, 23}).y(), sheet.ToSheet({12, 22}).y());
}

TEST(PlanSheet, TurnsWallsAlongIt) {
  for (const double degrees : {20.0, 70.0}) {
    const double direction = degrees * std::numbers::pi / 180;
    const PlanSheet sheet(FloorOf(100, 50, direction), {}, {180, 178});
    EXPECT_NEAR(sheet.turn(), (degrees < 45 ? -20 : 20) * std::numbers::pi / 180, 1e-9);
    const Eigen::Vector2d wall =
        sheet.Turned({std::cos(direction), std::sin(direction)}).normalized();
    EXPECT_NEAR(std::min(std::abs(wall.x()), std::abs(wall.y())), 0, 1e-9);
  }
}

TEST(PlanSheet, ShowsAllStationsAndCutsStraysOff) {
  model::FloorPlan plan = FloorOf(1000, 50, 0);
  // 5 m of floor, and one cell far away.
  for (int y = 0; y < plan.rows; ++y) {
    for (int x = 50; x < plan.columns; ++x) plan.cells[plan.At(x, y)] = model::PlanCell::kNothing;
  }
  plan.cells[plan.At(999, 3)] = model::PlanCell::kFloor;
  const PlanSheet sheet(plan, {{16.5, 22}}, {180, 178});
  EXPECT_TRUE(sheet.cut());
  EXPECT_EQ(sheet.scale(), 50);
  const Eigen::Vector2d station = sheet.ToSheet({16.5, 22});
  EXPECT_LT(station.x(), sheet.size().x());
  EXPECT_GT(station.x(), 0);
}

TEST(PlanSheet, OfNothingIsASheetAllTheSame) {
  const PlanSheet sheet(model::FloorPlan(), {}, {180, 178});
  EXPECT_GT(sheet.size().x(), 0);
  EXPECT_LE(sheet.size().x(), 180);
}

}  // namespace
}  // namespace vantage::report
