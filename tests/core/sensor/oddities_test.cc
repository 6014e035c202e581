// Scans of a room as they arrive when a program wrote them in another unit or frame.
#include "core/sensor/oddities.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/sensor/pcd.h"
#include "core/sensor/ptx.h"
#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

constexpr size_t kRoomColumns = 120;
constexpr size_t kRoomRows = 50;

// A room 2.8 m high, seen from 1.2 m over its floor.
std::vector<Eigen::Vector3d> Points(double factor = 1, const Eigen::Vector3d& shift = {0, 0, 0}) {
  std::vector<Eigen::Vector3d> points =
      ScanRoom(Evenly(-3.1, 2 * kPi / kRoomColumns, kRoomColumns),
               Evenly(Radians(-74), Radians(3), kRoomRows), [](size_t, size_t) { return true; });
  for (Eigen::Vector3d& p : points) p = factor * p + shift;
  return points;
}

std::string Said(const absl::StatusOr<ImportedScan>& scan) {
  EXPECT_TRUE(scan.ok()) << scan.status();
  std::string all;
  if (scan.ok()) {
    for (const std::string& oddity : Oddities(*scan)) all += oddity + "\n";
  }
  return all;
}

TEST(OdditiesTest, FeetInchesAndCentimetresAreNoticedAndMetresAreNot) {
  for (const auto& [unit, metres] :
       std::vector<std::pair<std::string, double>>{{"ft", 0.3048}, {"in", 0.0254}, {"cm", 0.01}}) {
    const std::string ptx = PtxText(kRoomColumns, kRoomRows, Points(1 / metres));
    EXPECT_NE(Said(ParsePtx(ptx, {})).find("--unit " + unit), std::string::npos)
        << unit << ": " << Said(ParsePtx(ptx, {}));
    ImportLimits limits;
    limits.unit = metres;
    EXPECT_EQ(Said(ParsePtx(ptx, limits)), "");
  }
  EXPECT_EQ(Said(ParsePtx(PtxText(kRoomColumns, kRoomRows, Points()), {})), "");
  // A hall of 9 m, from a tripod.
  std::vector<Eigen::Vector3d> hall = Points();
  for (Eigen::Vector3d& p : hall) {
    if (p.z() > 0) p *= 6;
  }
  EXPECT_EQ(Said(ParsePtx(PtxText(kRoomColumns, kRoomRows, hall), {})), "");
}

TEST(OdditiesTest, AFileInFeetIsReadAsTheSameScan) {
  const std::string matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 30 1\n";
  const auto metres = ParsePtx(PtxText(kRoomColumns, kRoomRows, Points(), matrix), {});
  ImportLimits feet;
  feet.unit = 0.3048;
  const auto read = ParsePtx(PtxText(kRoomColumns, kRoomRows, Points(1 / feet.unit), matrix), feet);
  ASSERT_TRUE(metres.ok() && read.ok());
  ASSERT_EQ(read->image.cells(), metres->image.cells());
  for (size_t i = 0; i < read->image.cells(); ++i) {
    EXPECT_NEAR(read->image.range[i], metres->image.range[i], 1e-5);
  }
  EXPECT_NEAR(read->T_world_scan->translation().y(), 20 * feet.unit, 1e-9);
}

TEST(OdditiesTest, ADepthCamerasFrameIsNoticed) {
  std::vector<Eigen::Vector3d> points;  // x to the right, y down, z ahead
  for (int v = -60; v < 60; ++v) {
    for (int u = -80; u < 80; ++u) {
      const Eigen::Vector3d ray(0.007 * u, 0.007 * v, 1);
      points.push_back(2.5 * ray);
    }
  }
  EXPECT_NE(Said(ParsePcd(PcdBinary(160, 120, points), {})).find("depth camera"),
            std::string::npos);
}

TEST(OdditiesTest, AGridThatLeansOrLostItsShapeIsSaid) {
  std::vector<Eigen::Vector3d> points = Points();
  // Turned by a tilt, its rows are no rows of directions any more.
  const Eigen::AngleAxisd tilt(0.2, Eigen::Vector3d::UnitX());
  for (Eigen::Vector3d& p : points) p = tilt * p;
  EXPECT_NE(Said(ParsePtx(PtxText(kRoomColumns, kRoomRows, points), {})).find("lines lean"),
            std::string::npos);
  // Sorted along an axis, as conversions do, its cells say nothing of directions.
  std::sort(points.begin(), points.end(),
            [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.x() < b.x(); });
  const std::string said = Said(ParsePtx(PtxText(kRoomColumns, kRoomRows, points), {}));
  EXPECT_NE(said.find("form no grid"), std::string::npos) << said;
}

}  // namespace
}  // namespace vantage::sensor
