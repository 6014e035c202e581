#include "core/sensor/scan_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <sstream>

#include "core/sensor/encoding.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/pcd.h"
#include "core/sensor/ptx.h"
#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

// 40 x 20 cells, a few without return; nothing nearer than range_min.
struct RoomFiles {
  std::vector<double> azimuth = Evenly(-3.1, 2 * kPi / 40, 40);
  std::vector<double> elevation = Evenly(Radians(-50), Radians(6), 20);
  std::vector<Eigen::Vector3d> points =
      ScanRoom(azimuth, elevation, [](size_t c, size_t r) { return (c + r) % 9 != 0; });

  std::vector<Eigen::Vector3d> RowByRow(double hole) const {
    std::vector<Eigen::Vector3d> rows;
    for (size_t row = 0; row < 20; ++row) {
      for (size_t column = 0; column < 40; ++column) {
        const Eigen::Vector3d& p = points[column * 20 + row];
        rows.push_back(p.isZero(0) ? Eigen::Vector3d(hole, hole, hole) : p);
      }
    }
    return rows;
  }
  std::vector<Eigen::Vector3d> Scaled(double factor) const {
    std::vector<Eigen::Vector3d> scaled = points;
    for (Eigen::Vector3d& p : scaled) p *= factor;
    return scaled;
  }
  std::vector<Eigen::Vector3d> Returns() const {
    std::vector<Eigen::Vector3d> returns;
    for (const Eigen::Vector3d& p : points) {
      if (!p.isZero(0)) returns.push_back(p);
    }
    return returns;
  }
};

TEST(ImportTest, AllFormsOfTheSameScanGiveTheSameImage) {
  const RoomFiles room;
  const absl::StatusOr<ImportedScan> ptx = ParsePtx(PtxText(40, 20, room.points), {});
  ASSERT_TRUE(ptx.ok()) << ptx.status();
  EXPECT_EQ(ptx->points, 800u);
  EXPECT_FALSE(ptx->T_world_scan.has_value());
  EXPECT_TRUE(ptx->scanner.Validate().ok()) << ptx->scanner.Validate();
  EXPECT_NEAR(ptx->scanner.elevation_min, Radians(-53), 1e-5);
  EXPECT_NEAR(ptx->scanner.elevation_step, Radians(6), 1e-5);
  EXPECT_EQ(ptx->image.SampleCount(), room.Returns().size());
  const double nan = std::nan("");
  const std::vector<Eigen::Vector3d> returns = room.Returns();
  for (const std::string& bytes :
       {PcdAscii(40, 20, room.RowByRow(nan)), PcdBinary(40, 20, room.RowByRow(nan)),
        PcdCompressed(40, 20, room.RowByRow(0)), PcdAscii(returns.size(), 1, returns),
        PcdBinary(returns.size(), 1, returns), PcdCompressed(returns.size(), 1, returns)}) {
    const absl::StatusOr<ImportedScan> pcd = ParsePcd(bytes, {});
    ASSERT_TRUE(pcd.ok()) << pcd.status();
    ExpectSameImage(pcd->image, ptx->image);
  }
}

// A ray out of a window that came back from a mountain refuses no scan: it is one without a return.
TEST(ImportTest, AFewReturnsBeyondAKilometreAreNone) {
  RoomFiles near;
  RoomFiles far;
  int count = 0;
  for (size_t i = 5; i < near.points.size(); i += 160) {
    if (near.points[i].isZero(0)) continue;
    far.points[i] *= 2000 / far.points[i].norm();
    near.points[i].setZero();
    ++count;
  }
  ASSERT_GT(count, 2);
  const ImportedScan expected = ParsePtx(PtxText(40, 20, near.points), {}).value();
  EXPECT_EQ(expected.far, 0u);
  for (const auto& scan : {ParsePtx(PtxText(40, 20, far.points), {}),
                           ParsePcd(PcdBinary(40, 20, far.RowByRow(0)), {})}) {
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->far, static_cast<size_t>(count));
    ExpectSameImage(scan->image, expected.image);
  }
  const std::vector<Eigen::Vector3d> returns = far.Returns();
  const auto loose = ParsePcd(PcdAscii(returns.size(), 1, returns), {});
  ASSERT_TRUE(loose.ok()) << loose.status();
  EXPECT_EQ(loose->far, static_cast<size_t>(count));
  EXPECT_EQ(loose->image.SampleCount(), expected.image.SampleCount());
}

TEST(ImportTest, PtxMatrixIsInRowVectorConvention) {
  const RoomFiles room;
  // Quarter turn about z: scanner x becomes world y. As row vectors: x' = p M.
  const std::string matrix = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n";
  const absl::StatusOr<ImportedScan> scan = ParsePtx(PtxText(40, 20, room.points, matrix), {});
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_TRUE(scan->T_world_scan.has_value());
  EXPECT_TRUE(
      (*scan->T_world_scan * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30), 1e-9));
}

TEST(ImportTest, PcdViewpointIsTheScannersPose) {
  const RoomFiles room;
  std::string bytes = PcdAscii(40, 20, room.RowByRow(0));
  const std::string from = "VIEWPOINT 0 0 0 1 0 0 0";
  bytes.replace(bytes.find(from), from.size(), "VIEWPOINT 10 20 30 0.70710678 0 0 0.70710678");
  const absl::StatusOr<ImportedScan> scan = ParsePcd(bytes, {});
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_TRUE(scan->T_world_scan.has_value());
  EXPECT_TRUE(
      (*scan->T_world_scan * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30), 1e-7));
}

// ---- What is refused, and what is said about it.

struct BadFile {
  const char* name;
  std::string bytes;
  absl::StatusCode code;
  const char* says;
};
// What test names show.
void PrintTo(const BadFile& tested, std::ostream* out) { *out << tested.name; }

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string WithLine(const std::string& text, int number, const std::string& line) {
  std::istringstream in(text);
  std::string out;
  std::string each;
  for (int i = 1; std::getline(in, each); ++i) out += (i == number ? line : each) + "\n";
  return out;
}

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
constexpr auto kUnimplemented = absl::StatusCode::kUnimplemented;

std::vector<BadFile> BadPtxFiles() {
  const RoomFiles room;
  const std::string good = PtxText(40, 20, room.points);
  return {
      {"Empty", "", kInvalid, "ends before"},
      {"Pcd", PcdHeaderText(1, 1, "ascii"), kInvalid, "line 1"},
      {"NoColumns", WithLine(good, 1, "0"), kInvalid, "0 columns"},
      {"NegativeRows", WithLine(good, 2, "-5"), kInvalid, "line 2"},
      {"HalfAColumn", WithLine(good, 1, "2.5"), kInvalid, "line 1"},
      {"Billions", WithLine(WithLine(good, 1, "100000"), 2, "10000"), kInvalid, "limit of"},
      {"Overflowing", WithLine(WithLine(good, 1, "1000000000000000"), 2, "1000000000000000"),
       kInvalid, "limit of"},
      {"AnnouncesMore", WithLine(good, 1, "90000"), kInvalid, "truncated"},
      {"Truncated", good.substr(0, good.rfind('\n', good.size() - 300) + 1), kInvalid, "announced"},
      {"CutInALine", good.substr(0, good.size() - 25), kInvalid, "truncated"},
      {"HeaderOnly", good.substr(0, 20), kInvalid, "truncated"},
      {"Nan", WithLine(good, 111, "nan 0 0 0.5"), kInvalid, "line 111: NaN"},
      {"Infinite", WithLine(good, 111, "1 inf 0 0.5"), kInvalid, "line 111: NaN or infinite"},
      {"Text", WithLine(good, 111, "one two three"), kInvalid, "line 111"},
      {"Binary", WithLine(good, 12, std::string("\0\1\2\3", 4)), kInvalid, "line 12: '?"},
      {"TwoNumbers", WithLine(good, 50, "1 2"), kInvalid, "line 50"},
      {"Millimetres", PtxText(40, 20, room.Scaled(1000)), kInvalid, "must be in metres"},
      {"Scaled", WithLine(good, 7, "1000 0 0 0"), kInvalid, "lines 7 to 10"},
      {"NanMatrix", WithLine(good, 10, "nan 0 0 1"), kInvalid, "line 10"},
      {"SecondScan", good + good, kUnimplemented, "line 811: a second scan"},
      {"TrailingText", good + "what is this\n", kInvalid, "line 811"},
      {"NoReturns", PtxText(2, 2, std::vector<Eigen::Vector3d>(4, Eigen::Vector3d::Zero())),
       kInvalid, "no ray"},
      {"OnlyBody", PtxText(2, 2, {{0.1, 0, 0}, {0.1, 0, 0.1}, {0, 0.1, 0}, {0, 0.1, 0.1}}),
       kInvalid, "sees only itself"},
  };
}

std::vector<BadFile> BadPcdFiles() {
  const RoomFiles room;
  const std::string ascii = PcdAscii(40, 20, room.RowByRow(0));
  const std::string binary = PcdBinary(40, 20, room.RowByRow(0));
  const std::string packed = PcdCompressed(40, 20, room.RowByRow(0));
  std::string damaged = packed;
  damaged[damaged.find("compressed\n") + 11 + 8] = static_cast<char>(0xFF);
  const std::vector<Eigen::Vector3d> returns = room.Returns();
  return {
      {"Empty", "", kInvalid, "PCD file?"},
      {"Ptx", PtxText(40, 20, room.points), kInvalid, "PCD file?"},
      {"NoDataEntry", "VERSION 0.7\nFIELDS x y z\n", kInvalid, "no DATA"},
      {"OldVersion", Replaced(ascii, "VERSION 0.7", "VERSION 0.3"), kUnimplemented, "VERSION 0.3"},
      {"NoZ", Replaced(ascii, "FIELDS intensity x y z", "FIELDS intensity x y w"), kInvalid,
       "no field z"},
      {"IntegerX", Replaced(ascii, "TYPE U F F F", "TYPE U I F F"), kInvalid, "of x"},
      {"ThreeByteX", Replaced(ascii, "SIZE 1 4 4 4", "SIZE 1 3 4 4"), kInvalid, "SIZE"},
      {"TooFewSizes", Replaced(ascii, "SIZE 1 4 4 4", "SIZE 4 4 4"), kInvalid, "SIZE"},
      {"HugeCount", Replaced(ascii, "COUNT 1 1 1 1", "COUNT 99999999 1 1 1"), kInvalid, "COUNT"},
      {"NoPoints", Replaced(ascii, "WIDTH 40", "WIDTH 0"), kInvalid, "empty"},
      {"Billions",
       Replaced(Replaced(ascii, "WIDTH 40", "WIDTH 1000000000"), "POINTS 800",
                "POINTS 20000000000"),
       kInvalid, "limit of"},
      {"Overflowing",
       Replaced(Replaced(ascii, "WIDTH 40", "WIDTH 9223372036854775808"), "HEIGHT 20",
                "HEIGHT 9223372036854775808"),
       kInvalid, "limit of"},
      {"PointsDisagree", Replaced(ascii, "POINTS 800", "POINTS 801"), kInvalid, "POINTS 801"},
      {"AnnouncesMore",
       Replaced(Replaced(binary, "WIDTH 40", "WIDTH 4000000"), "POINTS 800", "POINTS 80000000"),
       kInvalid, "truncated"},
      {"AsciiAnnouncesMore",
       Replaced(Replaced(ascii, "WIDTH 40", "WIDTH 4000000"), "POINTS 800", "POINTS 80000000"),
       kInvalid, "truncated"},
      {"BadViewpoint", Replaced(ascii, "0 0 0 1 0 0 0", "0 0 0 0 0 0 0"), kInvalid, "VIEWPOINT"},
      {"UnknownData", Replaced(ascii, "DATA ascii", "DATA zipped"), kUnimplemented, "zipped"},
      {"TruncatedAscii", ascii.substr(0, ascii.size() - 100), kInvalid, "truncated"},
      {"TruncatedBinary", binary.substr(0, binary.size() - 1), kInvalid, "truncated"},
      {"TruncatedPacked", packed.substr(0, packed.size() - 1), kInvalid, "truncated"},
      {"DamagedPacked", damaged, kInvalid, "damaged LZF"},
      {"Text", Replaced(ascii, "\n7 ", "\nx "), kInvalid, "point 0"},
      {"NanUnorganised",
       [&] {
         std::vector<Eigen::Vector3d> points = returns;
         points[17].y() = std::nan("");
         return PcdBinary(points.size(), 1, points);
       }(),
       kInvalid, "point 17: NaN"},
      {"HalfNanOrganised",
       [&] {
         std::vector<Eigen::Vector3d> points = room.RowByRow(0);
         points[21].z() = std::nan("");
         return PcdBinary(40, 20, points);
       }(),
       kInvalid, "point 21: NaN"},
      {"Infinite",
       [&] {
         std::vector<Eigen::Vector3d> points = returns;
         points[3].x() = std::numeric_limits<double>::infinity();
         return PcdBinary(points.size(), 1, points);
       }(),
       kInvalid, "point 3"},
      {"Millimetres",
       [&] {
         std::vector<Eigen::Vector3d> points = returns;
         for (Eigen::Vector3d& p : points) p *= 1000;
         return PcdBinary(points.size(), 1, points);
       }(),
       kInvalid, "must be in metres"},
      {"OnePoint", PcdAscii(1, 1, {Eigen::Vector3d(1, 1, 1)}), kInvalid, "2 x 2"},
  };
}

void ExpectRefused(const BadFile& file, const absl::Status& status) {
  EXPECT_EQ(status.code(), file.code) << status;
  EXPECT_NE(status.message().find(file.says), absl::string_view::npos) << status;
}

class BadPtxTest : public testing::TestWithParam<BadFile> {};
TEST_P(BadPtxTest, IsRefusedWithTheCause) {
  ExpectRefused(GetParam(), ParsePtx(GetParam().bytes, {}).status());
}
INSTANTIATE_TEST_SUITE_P(Files, BadPtxTest, testing::ValuesIn(BadPtxFiles()),
                         [](const auto& suite) { return std::string(suite.param.name); });

class BadPcdTest : public testing::TestWithParam<BadFile> {};
TEST_P(BadPcdTest, IsRefusedWithTheCause) {
  ExpectRefused(GetParam(), ParsePcd(GetParam().bytes, {}).status());
}
INSTANTIATE_TEST_SUITE_P(Files, BadPcdTest, testing::ValuesIn(BadPcdFiles()),
                         [](const auto& suite) { return std::string(suite.param.name); });

TEST(ReadScanFileTest, SaysWhatIsWrongWithTheFile) {
  const std::filesystem::path folder = testing::TempDir();
  EXPECT_EQ(ReadScanFile((folder / "no_such_scan.ptx").string(), {}).status().code(),
            absl::StatusCode::kNotFound);
  for (const char* name : {"scan.laz", "scan.fls", "scan"}) {
    const absl::Status other = ReadScanFile((folder / name).string(), {}).status();
    EXPECT_EQ(other.code(), kUnimplemented);
    EXPECT_NE(other.message().find("structured E57 or PTX"), std::string::npos) << other;
  }
  const std::string path = (folder / "import_test_room.PTX").string();
  const RoomFiles room;
  std::ofstream(path, std::ios::binary) << PtxText(40, 20, room.points);
  EXPECT_TRUE(ReadScanFile(path, {}).ok()) << ReadScanFile(path, {}).status();
  std::ofstream(path, std::ios::binary) << "rubbish";
  const absl::Status status = ReadScanFile(path, {}).status();
  EXPECT_EQ(status.code(), kInvalid);
  EXPECT_EQ(status.message().find(path), 0u) << status;
  std::filesystem::remove(path);
}

std::string MatrixAt(int x) {
  return "1 0 0 0\n0 1 0 0\n0 0 1 0\n" + std::to_string(x) + " 0 0 1\n";
}

TEST(ScanFileTest, SetupsAreReadOneByOne) {
  const RoomFiles room;
  const std::string path = (std::filesystem::path(testing::TempDir()) / "three.ptx").string();
  std::ofstream(path, std::ios::binary)
      << PtxText(40, 20, room.points, MatrixAt(1)) << PtxText(40, 20, room.Scaled(0.9), MatrixAt(2))
      << PtxText(40, 20, room.points, MatrixAt(3)) << "\n";
  const absl::StatusOr<ScanFile> file = ScanFile::Open(path);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->setups(), std::vector<std::string>(3));
  for (size_t i = 0; i < 3; ++i) {
    const absl::StatusOr<ImportedScan> scan = file->Read(i, {});
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->T_world_scan->translation().x(), static_cast<double>(i + 1));
  }
  EXPECT_EQ(file->Read(3, {}).status().code(), kInvalid);
  EXPECT_EQ(ReadScanFile(path, {}).status().code(), kInvalid);
  std::string bytes = PtxText(40, 20, room.points) + PtxText(40, 20, room.points);
  bytes.resize(bytes.size() - 500);
  std::ofstream(path, std::ios::binary) << bytes;
  const absl::Status cut = ScanFile::Open(path).value().Read(1, {}).status();
  EXPECT_EQ(cut.code(), kInvalid);
  EXPECT_NE(cut.message().find("set-up 2: PTX"), std::string::npos) << cut;
  std::filesystem::remove(path);
}

// What a server kept of a scan comes back as it was.
TEST(ReadScanFileTest, AnEncodedImageStaysToTheBit) {
  const RoomFiles room;
  const ImportedScan ptx = ParsePtx(PtxText(40, 20, room.points), {}).value();
  const std::string encoded = EncodeRangeImage(ptx.image);
  const std::string path = (std::filesystem::path(testing::TempDir()) / "kept.vrim").string();
  std::ofstream(path, std::ios::binary) << encoded;
  const absl::StatusOr<ImportedScan> read = ReadScanFile(path, {});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(EncodeRangeImage(read->image), encoded);
  EXPECT_FALSE(read->T_world_scan.has_value());
  EXPECT_TRUE(read->scanner.Validate().ok()) << read->scanner.Validate();
  EXPECT_EQ(read->scanner.elevation_min, ptx.scanner.elevation_min);
  EXPECT_EQ(read->scanner.elevation_step, ptx.scanner.elevation_step);
  std::ofstream(path, std::ios::binary) << encoded.substr(0, encoded.size() / 2);
  EXPECT_EQ(ReadScanFile(path, {}).status().code(), kInvalid);
  std::filesystem::remove(path);
}

// ---- Real scans.

class RealScanTest : public testing::TestWithParam<int> {
 protected:
  std::string Path(const std::string& extension) const {
    const char* shared = std::getenv("VANTAGE_SHARED_DATA");
    return std::string(shared == nullptr ? "" : shared) + "/pcl_room_scan/room_scan" +
           std::to_string(GetParam()) + extension;
  }
  void SetUp() override {
    if (!std::filesystem::exists(Path(".ptx"))) GTEST_SKIP() << "real scans are not here";
  }
};

TEST_P(RealScanTest, PtxAndPcdGiveTheSameImage) {
  const absl::StatusOr<ImportedScan> ptx = ReadScanFile(Path(".ptx"), {});
  const absl::StatusOr<ImportedScan> pcd = ReadScanFile(Path(".pcd"), {});
  ASSERT_TRUE(ptx.ok()) << ptx.status();
  ASSERT_TRUE(pcd.ok()) << pcd.status();
  EXPECT_FALSE(ptx->resampled);
  EXPECT_FALSE(pcd->resampled);
  ASSERT_EQ(ptx->image.columns(), pcd->image.columns());
  ASSERT_EQ(ptx->image.rows(), pcd->image.rows());
  EXPECT_GE(pcd->duplicates, pcd->points / 2);
  EXPECT_TRUE(ptx->image.full_turn);
  EXPECT_TRUE(pcd->image.full_turn);
  double worst = 0;
  for (size_t i = 0; i < ptx->image.azimuth.size(); ++i) {
    worst = std::max(worst, std::abs(ptx->image.azimuth[i] - pcd->image.azimuth[i]));
  }
  for (size_t i = 0; i < ptx->image.elevation.size(); ++i) {
    worst = std::max(worst, std::abs(ptx->image.elevation[i] - pcd->image.elevation[i]));
  }
  EXPECT_LT(worst, 1e-4);
  size_t different = 0;
  for (size_t i = 0; i < ptx->image.cells(); ++i) {
    different += std::abs(ptx->image.range[i] - pcd->image.range[i]) < 1e-3f ? 0 : 1;
  }
  RecordProperty("different_cells", static_cast<int>(different));
  RecordProperty("worst_axis_urad", static_cast<int>(1e6 * worst));
  // At most one cell in 10,000.
  EXPECT_LE(different, ptx->image.cells() / 10'000);
}

TEST_P(RealScanTest, BodyAndBlindZoneAreNoInformation) {
  const absl::StatusOr<ImportedScan> scan = ReadScanFile(Path(".ptx"), {});
  ASSERT_TRUE(scan.ok()) << scan.status();
  const RangeImage& image = scan->image;
  size_t body_or_blind = 0;
  size_t no_return_below = 0;
  size_t no_return_above = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const float range = image.at(column, row);
      const bool below = image.elevation[static_cast<size_t>(row)] < Radians(-40);
      EXPECT_FALSE(RangeImage::IsRange(range) && range < 0.5f);
      body_or_blind += range == RangeImage::kNoInformation ? 1 : 0;
      if (range == RangeImage::kNoReturn) ++(below ? no_return_below : no_return_above);
    }
  }
  // 18 % of the cells are body and about 1,150 more are blind; 97 and 53 above are openings.
  EXPECT_NEAR(static_cast<double>(body_or_blind) / static_cast<double>(image.cells()), 0.20, 0.02);
  EXPECT_LE(no_return_below, 20u);
  EXPECT_NEAR(static_cast<double>(no_return_above), GetParam() == 1 ? 97 : 53, 5);
  EXPECT_NEAR(Degrees(image.native_elevation_step), 0.972058, 1e-4);
  EXPECT_NEAR(Degrees(image.native_azimuth_step), 1.2, 0.05);
  EXPECT_TRUE(scan->scanner.Validate().ok()) << scan->scanner.Validate();
  EXPECT_GT(Degrees(scan->scanner.elevation_min), -60);
  EXPECT_LT(Degrees(scan->scanner.elevation_min), -40);
}

INSTANTIATE_TEST_SUITE_P(Scans, RealScanTest, testing::Values(1, 2));

}  // namespace
}  // namespace vantage::sensor
