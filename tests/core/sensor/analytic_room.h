// A box room whose ranges are known in closed form, and files of scans made in it.
#ifndef VANTAGE_TESTS_CORE_SENSOR_ANALYTIC_ROOM_H_
#define VANTAGE_TESTS_CORE_SENSOR_ANALYTIC_ROOM_H_

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "core/bytes/byte_order.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

// Distance from a place inside to the walls of the room [-2, 3] x [-1.5, 2.5] x [-1.2, 1.6] along a
// unit direction, m.
inline double RoomRange(const Eigen::Vector3d& direction,
                        const Eigen::Vector3d& from = Eigen::Vector3d::Zero()) {
  const Eigen::Vector3d low(-2, -1.5, -1.2);
  const Eigen::Vector3d high(3, 2.5, 1.6);
  double range = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double d = direction[axis];
    if (d > 0) range = std::min(range, (high[axis] - from[axis]) / d);
    if (d < 0) range = std::min(range, (low[axis] - from[axis]) / d);
  }
  return range;
}

inline Eigen::Vector3d DirectionOf(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

// A point per cell, column after column, bottom to top; zero where `returns` says no.
template <typename Returns>
std::vector<Eigen::Vector3d> ScanRoom(const std::vector<double>& azimuth,
                                      const std::vector<double>& elevation,
                                      const Returns& returns) {
  std::vector<Eigen::Vector3d> points;
  for (size_t column = 0; column < azimuth.size(); ++column) {
    for (size_t row = 0; row < elevation.size(); ++row) {
      const Eigen::Vector3d d = DirectionOf(azimuth[column], elevation[row]);
      points.push_back(returns(column, row) ? Eigen::Vector3d(RoomRange(d) * d)
                                            : Eigen::Vector3d(0, 0, 0));
    }
  }
  return points;
}

inline std::vector<double> Evenly(double first, double step, size_t count) {
  std::vector<double> lines;
  for (size_t i = 0; i < count; ++i) lines.push_back(first + step * static_cast<double>(i));
  return lines;
}

// To within `angles`, rad, and `ranges`, m.
inline void ExpectSameImage(const RangeImage& a, const RangeImage& b, double angles = 1e-5,
                            double ranges = 1e-5) {
  ASSERT_EQ(a.columns(), b.columns());
  ASSERT_EQ(a.rows(), b.rows());
  EXPECT_EQ(a.full_turn, b.full_turn);
  for (size_t i = 0; i < a.azimuth.size(); ++i) EXPECT_NEAR(a.azimuth[i], b.azimuth[i], angles);
  for (size_t i = 0; i < a.elevation.size(); ++i) {
    EXPECT_NEAR(a.elevation[i], b.elevation[i], angles);
  }
  for (size_t i = 0; i < a.range.size(); ++i) ASSERT_NEAR(a.range[i], b.range[i], ranges) << i;
}

inline std::string PtxText(size_t columns, size_t rows, const std::vector<Eigen::Vector3d>& points,
                           const std::string& matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n") {
  std::string text = std::to_string(columns) + "\n" + std::to_string(rows) +
                     "\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" + matrix;
  for (const Eigen::Vector3d& p : points) {
    char line[128];
    std::snprintf(line, sizeof(line), "%.7f %.7f %.7f 0.5\n", p.x(), p.y(), p.z());
    text += line;
  }
  return text;
}

inline std::string PcdHeaderText(size_t width, size_t height, const std::string& data,
                                 const std::string& viewpoint = "0 0 0 1 0 0 0") {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS intensity x y z\nSIZE 1 4 4 4\nTYPE U F F F\nCOUNT 1 1 "
         "1 "
         "1\nWIDTH " +
         std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT " + viewpoint +
         "\nPOINTS " + std::to_string(width * height) + "\nDATA " + data + "\n";
}

inline std::string PcdAscii(size_t width, size_t height,
                            const std::vector<Eigen::Vector3d>& points) {
  std::string text = PcdHeaderText(width, height, "ascii");
  for (const Eigen::Vector3d& p : points) {
    char line[128];
    std::snprintf(line, sizeof(line), "7 %.7f %.7f %.7f\n", p.x(), p.y(), p.z());
    text += line;
  }
  return text;
}

inline std::string PcdBinary(size_t width, size_t height,
                             const std::vector<Eigen::Vector3d>& points) {
  std::string bytes = PcdHeaderText(width, height, "binary");
  for (const Eigen::Vector3d& p : points) {
    bytes.push_back(7);
    for (int axis = 0; axis < 3; ++axis) {
      bytes::AppendLittleEndian(static_cast<float>(p[axis]), bytes);
    }
  }
  return bytes;
}

// The LZF block holds literal runs only, except for the constant first field, which is one byte and
// back references to it.
inline std::string PcdCompressed(size_t width, size_t height,
                                 const std::vector<Eigen::Vector3d>& points) {
  std::string block;
  block += std::string("\0\7", 2);
  for (size_t left = points.size() - 1; left > 0;) {
    // 3 to 8 bytes in the short form, 9 to 264 in the long one; literals for a rest below 3.
    if (left < 3) {
      block.push_back(static_cast<char>(left - 1));
      block.append(left, 7);
      left = 0;
    } else if (left <= 8) {
      block.push_back(static_cast<char>((left - 2) << 5));
      block.push_back(0);
      left = 0;
    } else {
      const size_t length = std::min<size_t>(left, 264);
      block.push_back(static_cast<char>(7 << 5));
      block.push_back(static_cast<char>(length - 9));
      block.push_back(0);
      left -= length;
    }
  }
  std::string planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const Eigen::Vector3d& p : points) {
      bytes::AppendLittleEndian(static_cast<float>(p[axis]), planes);
    }
  }
  for (size_t at = 0; at < planes.size(); at += 32) {
    const size_t length = std::min<size_t>(32, planes.size() - at);
    block.push_back(static_cast<char>(length - 1));
    block.append(planes, at, length);
  }
  std::string bytes = PcdHeaderText(width, height, "binary_compressed");
  bytes::AppendLittleEndian(static_cast<uint32_t>(block.size()), bytes);
  bytes::AppendLittleEndian(static_cast<uint32_t>(points.size() * 13), bytes);
  return bytes + block;
}

// A range image of the room from `centre`.
inline RangeImage RoomImage(std::vector<double> azimuth, std::vector<double> elevation,
                            double native, bool full_turn,
                            const Eigen::Vector3d& centre = {0, 0, 0}) {
  RangeImage image;
  image.azimuth = std::move(azimuth);
  image.elevation = std::move(elevation);
  image.full_turn = full_turn;
  image.native_azimuth_step = image.native_elevation_step = native;
  for (const double a : image.azimuth) {
    for (const double e : image.elevation) {
      image.range.push_back(static_cast<float>(RoomRange(DirectionOf(a, e), centre)));
    }
  }
  return image;
}

// All around and from -60 to 90 degrees.
inline RangeImage RoomAllAround(double step, const Eigen::Vector3d& centre = {0, 0, 0}) {
  const auto columns = static_cast<size_t>(std::lround(2 * kPi / step));
  return RoomImage(Evenly(-kPi, 2 * kPi / static_cast<double>(columns), columns),
                   Evenly(Radians(-60), step, static_cast<size_t>(Radians(150) / step)), step, true,
                   centre);
}

}  // namespace vantage::sensor

#endif  // VANTAGE_TESTS_CORE_SENSOR_ANALYTIC_ROOM_H_
