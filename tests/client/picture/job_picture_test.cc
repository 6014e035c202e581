#include "client/picture/job_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

namespace vantage::picture {
namespace {

constexpr double kPictureCell = 0.05;

void AddWall(JobPicture& plan, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
             model::SurfaceKind kind, double density) {
  const double length = (to - from).norm();
  const Eigen::Vector2d along = (to - from) / length;
  for (double t = kPictureCell / 2; t < length; t += kPictureCell) {
    const Eigen::Vector2d at = from + t * along;
    for (double z = kPictureCell / 2; z < 2.5; z += kPictureCell) {
      plan.surfaces.push_back({Eigen::Vector3d(at.x() + 0.01, at.y() + 0.01, z),
                               Eigen::Vector3f(-along.y(), along.x(), 0), kind,
                               kPictureCell * kPictureCell, static_cast<float>(density)});
    }
  }
}

// A room of 6 by 4 m: three walls measured, the east one missing.
JobPicture Room() {
  JobPicture plan;
  plan.title = "Cycle 1";
  plan.figures = {"coverage 50 %"};
  AddWall(plan, {0, 0}, {6, 0}, model::SurfaceKind::kTrue, 5000);
  AddWall(plan, {0, 4}, {6, 4}, model::SurfaceKind::kTrue, 5000);
  AddWall(plan, {0, 0}, {0, 4}, model::SurfaceKind::kTrue, 5000);
  AddWall(plan, {6, 0}, {6, 4}, model::SurfaceKind::kImage, 0);
  for (double x = 0.55; x < 5.5; x += 0.1) {
    for (double y = 0.55; y < 3.5; y += 0.1) {
      for (double z : {1.05, 1.45, 1.85}) {
        plan.scores.push_back({Eigen::Vector3f(x, y, z), static_cast<float>(1000 * x)});
      }
    }
  }
  plan.stations = {{1, {1.0, 2.0}, true}, {2, {2.0, 1.0}, false}};
  plan.candidates = {
      {{5.0, 2.0}, Eigen::AlignedBox2d(Eigen::Vector2d(4.8, 1.9), Eigen::Vector2d(5.2, 2.2))},
      {{4.0, 3.0}, std::nullopt}};
  plan.refused = {{3.0, 3.0}};
  return plan;
}

// Pixels of a colour, to within what rounding to a byte does.
int Count(const Canvas& canvas, const Colour& wanted) {
  const auto near = [](double a, double b) { return std::abs(a - b) < 2.5 / 255; };
  int count = 0;
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const Colour c = canvas.PixelAt(x, y);
      count += near(c.r, wanted.r) && near(c.g, wanted.g) && near(c.b, wanted.b) ? 1 : 0;
    }
  }
  return count;
}

TEST(JobPicture, DrawsMeasuredAndMissingSurface) {
  JobPicture plan = Room();
  const Canvas with = DrawJobPicture(plan);
  std::erase_if(plan.surfaces,
                [](const SurfaceElement& s) { return s.kind == model::SurfaceKind::kImage; });
  const Canvas without = DrawJobPicture(plan);
  // The legend shows every colour; the wall itself is 4 m long and a voxel wide.
  EXPECT_GT(Count(with, palette::kImageBoundary), Count(without, palette::kImageBoundary) + 1000);
  EXPECT_GT(Count(with, palette::kMeasured), 5000);
}

TEST(JobPicture, HeatMapRisesTowardsTheBestPlace) {
  const Canvas canvas = DrawJobPicture(Room());
  // The best and the worst place's colours both appear as whole columns of viewcells.
  EXPECT_GT(Count(canvas, Viridis(1.0)), 100);
  EXPECT_GT(Count(canvas, Viridis(550.0 / 5450.0)), 100);
}

TEST(JobPicture, WithoutAModelThereIsStillAPicture) {
  JobPicture plan;
  plan.title = "Nothing yet";
  const Canvas canvas = DrawJobPicture(plan);
  EXPECT_GT(canvas.width(), 100);
  EXPECT_GT(canvas.height(), 100);
}

TEST(JobPicture, NarrowAndWideSitesKeepTheirProportions) {
  for (const auto& [x, y] : {std::pair{40.0, 2.0}, std::pair{2.0, 40.0}}) {
    JobPicture plan;
    AddWall(plan, {0, 0}, {x, 0}, model::SurfaceKind::kTrue, 5000);
    AddWall(plan, {0, y}, {x, y}, model::SurfaceKind::kTrue, 5000);
    AddWall(plan, {0, 0}, {0, y}, model::SurfaceKind::kTrue, 5000);
    AddWall(plan, {x, 0}, {x, y}, model::SurfaceKind::kTrue, 5000);
    const Canvas canvas = DrawJobPicture(plan);
    EXPECT_LE(canvas.height(), 1600);
    EXPECT_GT(Count(canvas, palette::kMeasured), 1000);
  }
}

TEST(JobPicture, LongFiguresTakeAsManyLinesAsTheyNeed) {
  JobPicture plan = Room();
  const int height = DrawJobPicture(plan).height();
  for (int i = 0; i < 40; ++i) plan.figures[0] += " and more";
  EXPECT_EQ(DrawJobPicture(plan).height(), height + 2 * 24);
}

TEST(JobPicture, WritesAPng) {
  const std::string path = ::testing::TempDir() + "/vantage_job_picture_test.png";
  ASSERT_TRUE(WriteJobPicture(Room(), path).ok());
  std::ifstream file(path, std::ios::binary);
  std::string head(8, '\0');
  file.read(head.data(), 8);
  EXPECT_EQ(head, std::string("\x89PNG\r\n\x1a\n", 8));
}

TEST(JobPicture, NamesTheFileThatCannotBeWritten) {
  const absl::Status status = WriteJobPicture(Room(), "/nonexistent-folder/picture.png");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_NE(std::string(status.message()).find("/nonexistent-folder/picture.png"),
            std::string::npos);
}

}  // namespace
}  // namespace vantage::picture
