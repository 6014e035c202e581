// Intensity and colour stay with their returns, from every format that has them, and cost nothing
// where nobody asks for them.
#include "core/sensor/appearance.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/bytes/byte_order.h"
#include "core/sensor/e57.h"
#include "core/sensor/encoding.h"
#include "core/sensor/scan_file.h"
#include "core/sensor/thinning.h"
#include "tests/core/sensor/analytic_room.h"
#include "tests/core/sensor/read_both_ways.h"
#include "tests/support/e57_writer.h"

namespace vantage::sensor {
namespace {

constexpr size_t kLookColumns = 90;
constexpr size_t kLookRows = 40;
constexpr AppearanceKinds kBoth = {true, true};

ImportLimits Wanting(const AppearanceKinds& kinds) {
  ImportLimits limits;
  limits.appearance = kinds;
  return limits;
}

// What a return looks like is told by its direction, so that a test knows it of every cell.
double BrightOf(const Eigen::Vector3d& direction) { return (direction.z() + 1) / 2; }
Eigen::Vector3d ColourOfRay(const Eigen::Vector3d& direction) {
  return (direction.array() + 1) / 2;
}

// The room's returns, turned by `tilt`; column after column.
std::vector<Eigen::Vector3d> LookPoints(double tilt = 0) {
  const Eigen::AngleAxisd turn(tilt, Eigen::Vector3d(2, 1, 0).normalized());
  std::vector<Eigen::Vector3d> points =
      ScanRoom(Evenly(-3.1, 2 * kPi / kLookColumns, kLookColumns),
               Evenly(Radians(-50), Radians(3), kLookRows),
               [](size_t c, size_t r) { return (c + 2 * r) % 13 != 0; });
  for (Eigen::Vector3d& p : points) p = turn * p;
  return points;
}

// Intensities from -20 to 180, colours as bytes; `grid`: with row and column.
std::string LooksE57(const std::vector<Eigen::Vector3d>& points, bool grid) {
  std::vector<double> x, y, z, bright;
  std::vector<int64_t> row, column;
  std::vector<std::vector<int64_t>> colours(3);
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].isZero(0)) continue;
    const Eigen::Vector3d ray = points[i].normalized();
    x.push_back(points[i].x());
    y.push_back(points[i].y());
    z.push_back(points[i].z());
    bright.push_back(-20 + 200 * BrightOf(ray));
    for (size_t k = 0; k < 3; ++k) {
      colours[k].push_back(std::lround(255 * ColourOfRay(ray)[static_cast<Eigen::Index>(k)]));
    }
    column.push_back(static_cast<int64_t>(i / kLookRows));
    row.push_back(static_cast<int64_t>(i % kLookRows));
  }
  using namespace test_support;  // NOLINT: its functions are named after the format
  std::vector<E57Stream> streams = {E57Doubles("cartesianX", x),
                                    E57Doubles("cartesianY", y),
                                    E57Doubles("cartesianZ", z),
                                    E57Floats("intensity", bright),
                                    E57Integers("colorRed", 0, 255, colours[0]),
                                    E57Integers("colorGreen", 0, 255, colours[1]),
                                    E57Integers("colorBlue", 0, 255, colours[2])};
  if (grid) {
    streams.push_back(E57Integers("rowIndex", 0, kLookRows - 1, row));
    streams.push_back(E57Integers("columnIndex", 0, kLookColumns - 1, column));
  }
  const std::string head =
      "<intensityLimits type=\"Structure\"><intensityMinimum type=\"Float\">-20</intensityMinimum>"
      "<intensityMaximum type=\"Float\">180</intensityMaximum></intensityLimits>";
  E57Options options;
  options.packets = 20;
  return WriteE57({{head, streams, x.size(), ""}}, options);
}

std::string LooksPtx(const std::vector<Eigen::Vector3d>& points) {
  std::string text =
      absl::StrFormat("%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
                      kLookColumns, kLookRows);
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d ray = p.isZero(0) ? Eigen::Vector3d(0, 0, 0) : p.normalized();
    const Eigen::Vector3d colour = 255 * ColourOfRay(ray);
    absl::StrAppendFormat(&text, "%.7f %.7f %.7f %.6f %.0f %.0f %.0f\n", p.x(), p.y(), p.z(),
                          BrightOf(ray), std::round(colour.x()), std::round(colour.y()),
                          std::round(colour.z()));
  }
  return text;
}

// Version 1.2, point format 3; `whole`: what a full colour is stored as.
std::string LooksLas(const std::vector<Eigen::Vector3d>& points, double whole) {
  constexpr double kScale = 1e-5;  // m
  std::string las(227, '\0');
  const auto put = [](std::string& bytes, size_t at, auto value) {
    std::memcpy(&bytes[at], &value, sizeof(value));
  };
  std::string records;
  uint32_t count = 0;
  for (const Eigen::Vector3d& p : points) {
    if (p.isZero(0)) continue;
    ++count;
    std::string record(34, '\0');
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      put(record, 4 * axis, static_cast<int32_t>(std::lround(p[k] / kScale)));
      put(record, 28 + 2 * axis,
          static_cast<uint16_t>(std::lround(whole * ColourOfRay(p.normalized())[k])));
    }
    put(record, 12, static_cast<uint16_t>(std::lround(65535 * BrightOf(p.normalized()))));
    records += record;
  }
  las.replace(0, 4, "LASF");
  put(las, 24, uint8_t{1});
  put(las, 25, uint8_t{2});
  put(las, 94, uint16_t{227});
  put(las, 96, uint32_t{227});
  put(las, 104, uint8_t{3});
  put(las, 105, uint16_t{34});
  put(las, 107, count);
  for (size_t axis = 0; axis < 3; ++axis) put(las, 131 + 8 * axis, kScale);
  return las + records;
}

std::string LooksPly(const std::vector<Eigen::Vector3d>& points) {
  std::string records;
  size_t count = 0;
  for (const Eigen::Vector3d& p : points) {
    if (p.isZero(0)) continue;
    ++count;
    for (const double value : p) bytes::AppendLittleEndian(value, records);
    bytes::AppendLittleEndian(static_cast<uint16_t>(std::lround(65535 * BrightOf(p.normalized()))),
                              records);
    for (const double value : ColourOfRay(p.normalized())) {
      records.push_back(static_cast<char>(std::lround(255 * value)));
    }
  }
  return absl::StrFormat(
             "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\n"
             "property double y\nproperty double z\nproperty ushort intensity\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
             count) +
         records;
}

absl::StatusOr<ImportedScan> ReadLooks(const std::string& name, const std::string& bytes,
                                       const ImportLimits& limits) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / absl::StrFormat("appearance_test_%d", getpid());
  std::filesystem::create_directories(folder);
  const std::string path = (folder / name).string();
  std::ofstream(path, std::ios::binary) << bytes;
  const bool loose = !name.ends_with("e57") && !name.ends_with("ptx");
  absl::StatusOr<ImportedScan> scan =
      ReadBothWays(
          path, loose ? std::optional(Eigen::Vector3d(0, 0, 0)) : std::optional<Eigen::Vector3d>(),
          limits)
          .front();
  std::filesystem::remove_all(folder);
  return scan;
}

// Each cell looks as its direction says, to within `off` of the whole.
void ExpectLooks(const RangeImage& image, double off) {
  ASSERT_EQ(image.appearance.intensity.size(), image.cells());
  ASSERT_EQ(image.appearance.colour.size(), image.cells());
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const size_t cell = image.Index(c, r);
      const uint16_t bright = image.appearance.intensity[cell];
      const Colour& colour = image.appearance.colour[cell];
      if (!RangeImage::IsRange(image.range[cell])) {
        ASSERT_EQ(bright, 0);
        ASSERT_EQ(colour, Colour{});
        continue;
      }
      const Eigen::Vector3d ray = image.Direction(c, r);
      ASSERT_NEAR(bright / 65535.0, BrightOf(ray), 1e-4 + off) << c << " " << r;
      for (size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(colour[k] / 255.0, ColourOfRay(ray)[static_cast<Eigen::Index>(k)],
                    0.6 / 255 + 1e-4 + off);
      }
    }
  }
}

TEST(AppearanceTest, StaysWithItsReturnInEveryFormat) {
  const std::vector<Eigen::Vector3d> points = LookPoints();
  std::vector<Eigen::Vector3d> in_any_order = points;
  std::mt19937_64 random(3);
  std::shuffle(in_any_order.begin(), in_any_order.end(), random);
  const std::vector<std::pair<std::string, std::string>> files = {
      {"grid.e57", LooksE57(points, true)},
      {"any.e57", LooksE57(in_any_order, false)},
      {"grid.ptx", LooksPtx(points)},
      {"any.las", LooksLas(in_any_order, 65535)},
      {"eight_bits.las", LooksLas(in_any_order, 255)},
      {"any.ply", LooksPly(in_any_order)}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const auto scan = ReadLooks(name, bytes, Wanting(kBoth));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->appearance.intensity);
    EXPECT_TRUE(scan->appearance.colour);
    // Sixteen bits are cut to eight.
    ExpectLooks(scan->image, name == "any.las" ? 1.0 / 255 : 0);
    // Nobody asks: the same image, without.
    const auto without = ReadLooks(name, bytes, {});
    ASSERT_TRUE(without.ok()) << without.status();
    EXPECT_TRUE(without->appearance.colour);
    EXPECT_FALSE(without->image.appearance.kinds().any());
    EXPECT_EQ(without->image.range, scan->image.range);
    const auto one = ReadLooks(name, bytes, Wanting({false, true}));
    ASSERT_TRUE(one.ok()) << one.status();
    EXPECT_TRUE(one->image.appearance.intensity.empty());
    EXPECT_EQ(one->image.appearance.colour, scan->image.appearance.colour);
  }
}

TEST(AppearanceTest, StaysWithItsReturnWhereLinesLeanOrThereAreNone) {
  for (const double degrees : {2.0, 30.0}) {
    SCOPED_TRACE(degrees);
    const auto scan =
        ReadLooks("lean.e57", LooksE57(LookPoints(Radians(degrees)), true), Wanting(kBoth));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->resampled);
    // A cell shows the return nearest to its direction: a step of 4 degrees off at most.
    ExpectLooks(scan->image, 0.04);
  }
}

TEST(AppearanceTest, ThinsAndTravelsWithTheImage) {
  const auto scan = ReadLooks("grid.e57", LooksE57(LookPoints(), true), Wanting(kBoth));
  ASSERT_TRUE(scan.ok()) << scan.status();
  const RangeImage thin = Thinned(scan->image, Radians(9));
  ASSERT_LT(thin.cells(), scan->image.cells() / 4);
  ExpectLooks(thin, 0);
  for (const AppearanceKinds& kinds :
       {kBoth, AppearanceKinds{true, false}, AppearanceKinds{false, true}}) {
    RangeImage sent = thin;
    if (!kinds.intensity) sent.appearance.intensity = {};
    if (!kinds.colour) sent.appearance.colour = {};
    const std::string bytes = EncodeRangeImage(sent);
    EXPECT_EQ(bytes.size(), EncodedSize(sent.azimuth.size(), sent.elevation.size(), kinds));
    const auto got = DecodeRangeImage(bytes, 1'000'000, RangeImageDecoder::Keep::kAll);
    ASSERT_TRUE(got.ok()) << got.status();
    EXPECT_EQ(got->appearance.intensity, sent.appearance.intensity);
    EXPECT_EQ(got->appearance.colour, sent.appearance.colour);
    EXPECT_EQ(EncodeRangeImage(*got), bytes);
    const auto ranges = DecodeRangeImage(bytes, 1'000'000);
    ASSERT_TRUE(ranges.ok()) << ranges.status();
    EXPECT_EQ(ranges->range, got->range);
    EXPECT_FALSE(ranges->appearance.kinds().any());
  }
}

TEST(AppearanceTest, ACellWithoutARangeHasNone) {
  const auto scan = ReadLooks("grid.e57", LooksE57(LookPoints(), true), Wanting({false, true}));
  ASSERT_TRUE(scan.ok()) << scan.status();
  std::string bytes = EncodeRangeImage(scan->image);
  size_t empty = 0;
  while (RangeImage::IsRange(scan->image.at(0, static_cast<int>(empty)))) ++empty;
  const size_t colours = RangeImageDecoder::kHeaderBytes + 8 * kLookRows + 8 + 4 * kLookRows;
  bytes[colours + kLookRows + empty] = 1;
  const auto spoilt = DecodeRangeImage(bytes, 1'000'000);
  ASSERT_FALSE(spoilt.ok());
  EXPECT_NE(spoilt.status().message().find("column 0"), std::string::npos) << spoilt.status();
}

}  // namespace
}  // namespace vantage::sensor
