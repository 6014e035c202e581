// Loose points of one room, in each format that does not say where they were seen from.
#include "core/sensor/point_cloud.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/bytes/byte_order.h"
#include "core/sensor/las.h"
#include "core/sensor/scan_file.h"
#include "tests/core/sensor/analytic_room.h"
#include "tests/core/sensor/read_both_ways.h"

namespace vantage::sensor {
namespace {

const Eigen::Vector3d kStation(691'412.3125, 5'335'120.25, 520.5);  // UTM, with altitude

std::vector<double> Azimuths() { return Evenly(-3.1, 2 * kPi / 60, 60); }
std::vector<double> Elevations() { return Evenly(Radians(-60), Radians(4), 30); }

// In the world's frame, in another order than they were scanned in.
std::vector<Eigen::Vector3d> RoomPoints() {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p :
       ScanRoom(Azimuths(), Elevations(), [](size_t c, size_t r) { return (c + r) % 9 != 0; })) {
    if (!p.isZero(0)) points.push_back(p + kStation);
  }
  std::reverse(points.begin(), points.end());
  return points;
}

// A LAS file after the standard: 1.2 with point format 3, or 1.4 with format 6.
std::string LasFile(const std::vector<Eigen::Vector3d>& points, int minor, size_t extra = 0) {
  const uint8_t format = minor == 4 ? 6 : 3;
  const uint16_t record = static_cast<uint16_t>((minor == 4 ? 30 : 34) + extra);
  const uint16_t header_bytes = minor == 4 ? 375 : 227;
  const Eigen::Vector3d offset(691'000, 5'335'000, 500);
  constexpr double kScale = 1e-5;  // m
  std::string las(header_bytes, '\0');
  const auto put = [&](size_t at, auto value) { std::memcpy(&las[at], &value, sizeof(value)); };
  las.replace(0, 4, "LASF");
  put(24, uint8_t{1});
  put(25, static_cast<uint8_t>(minor));
  put(94, header_bytes);
  put(96, static_cast<uint32_t>(header_bytes));
  put(104, format);
  put(105, record);
  put(107, minor == 4 ? uint32_t{0} : static_cast<uint32_t>(points.size()));
  for (int axis = 0; axis < 3; ++axis) {
    put(131 + 8 * static_cast<size_t>(axis), kScale);
    put(155 + 8 * static_cast<size_t>(axis), offset[axis]);
  }
  if (minor == 4) put(247, static_cast<uint64_t>(points.size()));
  for (const Eigen::Vector3d& p : points) {
    std::string bytes(record, '\0');
    for (int axis = 0; axis < 3; ++axis) {
      const auto steps = static_cast<int32_t>(std::lround((p[axis] - offset[axis]) / kScale));
      std::memcpy(&bytes[4 * static_cast<size_t>(axis)], &steps, 4);
    }
    las += bytes;
  }
  return las;
}

std::string PlyFile(const std::vector<Eigen::Vector3d>& points) {
  std::string ply = absl::StrFormat(
      "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\n"
      "property double y\nproperty double z\nproperty uchar red\nend_header\n",
      points.size());
  for (const Eigen::Vector3d& p : points) {
    for (int axis = 0; axis < 3; ++axis) bytes::AppendLittleEndian(p[axis], ply);
    ply += '\x7f';
  }
  return ply;
}

std::string Text(const std::vector<Eigen::Vector3d>& points, const char* format,
                 const std::string& header) {
  std::string text = header;
  for (const Eigen::Vector3d& p : points) {
    char line[200];
    std::snprintf(line, sizeof(line), format, p.x(), p.y(), p.z());
    text += line;
  }
  return text;
}

class PointFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  absl::StatusOr<ImportedScan> Read(const std::string& name, const std::string& bytes,
                                    const std::optional<Eigen::Vector3d>& station = kStation) {
    const std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << bytes;
    return ReadBothWays(path, station).front();
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / absl::StrFormat("point_cloud_test_%d", getpid());
};

TEST_F(PointFiles, AllFormatsGiveTheRoom) {
  const std::vector<Eigen::Vector3d> points = RoomPoints();
  std::string commas = Text(points, "%.6f;%.6f;%.6f;12\n", "X;Y;Z;I\n");
  std::replace(commas.begin(), commas.end(), '.', ',');  // as in Germany
  const std::vector<std::pair<std::string, std::string>> files = {
      {"room.las", LasFile(points, 2)},
      {"extra.las", LasFile(points, 4, 7)},
      {"room.ply", PlyFile(points)},
      {"room.xyz", Text(points, "%.6f %.6f %.6f\n", "# a room\n\n")},
      {"room.pts",
       Text(points, "%.6f %.6f %.6f -1200 90 91 92\n", absl::StrFormat("%d\n", points.size()))},
      {"room.csv", Text(points, "%.6f, %.6f, %.6f, wall\n", "//x,y,z,kind\n")},
      {"room.txt", commas}};
  for (const auto& [name, bytes] : files) {
    const auto scan = Read(name, bytes);
    ASSERT_TRUE(scan.ok()) << name << ": " << scan.status();
    EXPECT_EQ(scan->image.columns(), 60) << name;
    EXPECT_EQ(scan->image.rows(), 30) << name;
    EXPECT_EQ(scan->image.SampleCount(), points.size()) << name;
    EXPECT_FALSE(scan->resampled) << name;
    ASSERT_TRUE(scan->T_world_scan.has_value()) << name;
    EXPECT_EQ(scan->T_world_scan->translation(), kStation) << name;
    for (int column = 0; column < 60; column += 7) {
      for (int row = 0; row < 30; row += 5) {
        const float range = scan->image.at(column, row);
        if (!RangeImage::IsRange(range)) continue;
        EXPECT_NEAR(range, RoomRange(scan->image.Direction(column, row)), 1e-4) << name;
      }
    }
  }
}

// VIEWPOINT is the identity in files whose points were written in the world's frame.
TEST_F(PointFiles, OfPcdInTheWorldsFrameTheStationIsTheCentre) {
  const Eigen::Vector3d station(12, 3, 1);
  std::vector<Eigen::Vector3d> points = RoomPoints();
  for (Eigen::Vector3d& p : points) p += station - kStation;
  const auto scan = Read("room.pcd", PcdBinary(points.size(), 1, points), station);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->image.columns(), 60);
  EXPECT_EQ(scan->image.SampleCount(), points.size());
  ASSERT_TRUE(scan->T_world_scan.has_value());
  EXPECT_EQ(scan->T_world_scan->translation(), station);
}

// A VIEWPOINT that says where the scanner stood among points in the world's frame.
TEST_F(PointFiles, PcdInTheWorldsFrameIsNoticedByItsViewpoint) {
  std::vector<Eigen::Vector3d> points = RoomPoints();
  for (Eigen::Vector3d& p : points) p += Eigen::Vector3d(12, 3, 1) - kStation;
  std::string pcd = PcdBinary(points.size(), 1, points);
  const std::string none = "VIEWPOINT 0 0 0 1 0 0 0";
  pcd.replace(pcd.find(none), none.size(), "VIEWPOINT 12 3 1 1 0 0 0");
  const auto scan = Read("room.pcd", pcd, {});
  ASSERT_FALSE(scan.ok());
  EXPECT_NE(scan.status().message().find("--station 12,3,1"), std::string::npos) << scan.status();
  EXPECT_TRUE(Read("room.pcd", pcd, Eigen::Vector3d(12, 3, 1)).ok());
}

TEST_F(PointFiles, WithdrawnPointsOfLasAreLeftOut) {
  const std::vector<Eigen::Vector3d> points = RoomPoints();
  for (const int minor : {2, 4}) {
    std::string las = LasFile(points, minor);
    const size_t header = minor == 4 ? 375 : 227;
    const size_t record = minor == 4 ? 30 : 34;
    for (size_t i = 0; i < 10; ++i) las[header + i * record + 15] = minor == 4 ? 0x04 : '\x80';
    const auto scan = Read("room.las", las);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->image.SampleCount(), points.size() - 10);
  }
}

TEST_F(PointFiles, AreRefusedWithWhatHelps) {
  const std::vector<Eigen::Vector3d> points = RoomPoints();
  const auto refused = [&](const std::string& name, const std::string& bytes, const char* why,
                           const std::optional<Eigen::Vector3d>& station = kStation) {
    const auto scan = Read(name, bytes, station);
    ASSERT_FALSE(scan.ok()) << name << ", " << why;
    EXPECT_NE(scan.status().message().find(why), std::string::npos) << scan.status();
    EXPECT_NE(scan.status().message().find(name), std::string::npos) << scan.status();
  };
  const std::string las = LasFile(points, 2);
  for (const char* name : {"a.las", "a.ply", "a.xyz"}) refused(name, las, "--station", {});
  refused("a.ptx", "", "leave out the station");
  refused("a.laz", las, "laszip -i");
  std::string packed = las;
  packed[104] = static_cast<char>(packed[104] | 0x80);
  refused("packed.las", packed, "laszip -i");
  refused("short.las", las.substr(0, las.size() - 1), "truncated");
  refused("header.las", las.substr(0, 100), "truncated within the header");
  refused("none.las", "<html>", "is this a LAS file");
  std::string scale = las;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(&scale[131], &nan, 8);
  refused("scale.las", scale, "scale factors");
  refused("empty.las", LasFile({}, 2), "no points");
  refused("line.xyz", Text(points, "%.6f %.6f %.6f\n", "") + "1 2\n", "where x, y and z");
  refused("nan.xyz", Text(points, "%.6f %.6f %.6f\n", "") + "1 2 nan\n", "NaN or infinite");
  refused("words.txt", "no points at all\n", "no line begins with x, y and z");
  refused("away.las", las, "frame", Eigen::Vector3d(0, 0, 0));
  refused("mesh.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no element vertex");
}

// Two scans in one file: what the second saw of the next room lies behind the first one's walls.
TEST_F(PointFiles, PointsOfSeveralStationsAreNoScan) {
  std::vector<Eigen::Vector3d> points = RoomPoints();
  for (const Eigen::Vector3d& p : RoomPoints()) points.push_back(p + Eigen::Vector3d(5.3, 0.4, 0));
  const auto scan = Read("both.las", LasFile(points, 2));
  ASSERT_FALSE(scan.ok());
  EXPECT_NE(scan.status().message().find("not all seen from"), std::string::npos) << scan.status();
}

}  // namespace
}  // namespace vantage::sensor
