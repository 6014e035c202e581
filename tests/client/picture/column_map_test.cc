#include "client/picture/column_map.h"

#include <gtest/gtest.h>

namespace vantage::picture {
namespace {

constexpr double kCell = 0.05;
constexpr double kDensity = 2500;

SurfaceElement At(double x, double y, double z, const Eigen::Vector3f& normal,
                  model::SurfaceKind kind, double density) {
  return {Eigen::Vector3d(x, y, z), normal, kind, kCell * kCell, static_cast<float>(density)};
}

// A wall column of the given height at (x, y).
void AddWall(std::vector<SurfaceElement>& out, double x, double y, double height,
             model::SurfaceKind kind, double density) {
  for (double z = kCell / 2; z < height; z += kCell) {
    out.push_back(At(x, y, z, Eigen::Vector3f::UnitX(), kind, density));
  }
}

const Column& ColumnAt(const ColumnMap& map, double x, double y) {
  const Eigen::Vector2d at = (Eigen::Vector2d(x, y) - map.origin()) / map.cell();
  return map.At(static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())));
}

TEST(ColumnMap, EmptyModelIsAnEmptyMap) {
  const ColumnMap map({}, kCell, kDensity);
  EXPECT_EQ(map.width(), 0);
  EXPECT_EQ(map.height(), 0);
}

TEST(ColumnMap, ShowsWhatStandsInEachColumn) {
  std::vector<SurfaceElement> surfaces;
  AddWall(surfaces, 0.025, 0.025, 2.5, model::SurfaceKind::kTrue, 5000);
  AddWall(surfaces, 0.525, 0.025, 2.5, model::SurfaceKind::kTrue, 100);
  AddWall(surfaces, 1.025, 0.025, 2.5, model::SurfaceKind::kOcclusion, 0);
  AddWall(surfaces, 1.525, 0.025, 2.5, model::SurfaceKind::kHole, 0);
  AddWall(surfaces, 2.025, 0.025, 2.5, model::SurfaceKind::kImage, 0);
  surfaces.push_back(
      At(2.525, 0.025, 0, Eigen::Vector3f::UnitZ(), model::SurfaceKind::kTrue, 5000));
  surfaces.push_back(At(3.025, 0.025, 0, Eigen::Vector3f::UnitZ(), model::SurfaceKind::kTrue, 100));
  const ColumnMap map(surfaces, kCell, kDensity, 1.0);
  EXPECT_EQ(ColumnAt(map, 0.025, 0.025).shown, ColumnClass::kMeasured);
  EXPECT_EQ(ColumnAt(map, 0.525, 0.025).shown, ColumnClass::kUnderSampled);
  EXPECT_EQ(ColumnAt(map, 1.025, 0.025).shown, ColumnClass::kOcclusion);
  EXPECT_EQ(ColumnAt(map, 1.525, 0.025).shown, ColumnClass::kHole);
  EXPECT_EQ(ColumnAt(map, 2.025, 0.025).shown, ColumnClass::kImage);
  EXPECT_EQ(ColumnAt(map, 2.525, 0.025).shown, ColumnClass::kMeasuredFlat);
  EXPECT_EQ(ColumnAt(map, 3.025, 0.025).shown, ColumnClass::kUnderSampledFlat);
  EXPECT_EQ(ColumnAt(map, 0.275, 0.025).shown, ColumnClass::kNothing);
  EXPECT_FLOAT_EQ(ColumnAt(map, 0.025, 0.025).strength, 1.0f);
}

TEST(ColumnMap, MissingSurfaceShowsOnlyWhereItIsNotNegligible) {
  std::vector<SurfaceElement> surfaces;
  AddWall(surfaces, 0.025, 0.025, 2.5, model::SurfaceKind::kTrue, 5000);
  AddWall(surfaces, 0.025, 0.025, 0.3, model::SurfaceKind::kOcclusion, 0);
  AddWall(surfaces, 0.525, 0.025, 2.5, model::SurfaceKind::kTrue, 5000);
  AddWall(surfaces, 0.525, 0.025, 1.0, model::SurfaceKind::kOcclusion, 0);
  const ColumnMap map(surfaces, kCell, kDensity, 1.0);
  EXPECT_EQ(ColumnAt(map, 0.025, 0.025).shown, ColumnClass::kMeasured);
  EXPECT_EQ(ColumnAt(map, 0.525, 0.025).shown, ColumnClass::kOcclusion);
}

TEST(ColumnMap, CutsOffWhatEscapedThroughADoor) {
  std::vector<SurfaceElement> surfaces;
  for (int i = 0; i < 200; ++i)
    AddWall(surfaces, 0.025 + i * kCell, 0.025, 2.5, model::SurfaceKind::kTrue, 5000);
  surfaces.push_back(At(150, 0, 1, Eigen::Vector3f::UnitX(), model::SurfaceKind::kTrue, 10));
  const ColumnMap map(surfaces, kCell, kDensity, 0.99);
  EXPECT_LT(map.bounds().max().x(), 11);
  EXPECT_GT(map.bounds().max().x(), 9.8);
}

TEST(ColumnMap, NegativeCoordinatesFallIntoTheirOwnColumns) {
  std::vector<SurfaceElement> surfaces;
  AddWall(surfaces, -0.01, -0.01, 2.0, model::SurfaceKind::kHole, 0);
  AddWall(surfaces, 0.01, 0.01, 2.0, model::SurfaceKind::kImage, 0);
  const ColumnMap map(surfaces, kCell, kDensity, 1.0);
  EXPECT_EQ(ColumnAt(map, -0.01, -0.01).shown, ColumnClass::kHole);
  EXPECT_EQ(ColumnAt(map, 0.01, 0.01).shown, ColumnClass::kImage);
}

}  // namespace
}  // namespace vantage::picture
