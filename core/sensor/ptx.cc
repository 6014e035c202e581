#include "core/sensor/ptx.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/text_scanner.h"
#include "core/sensor/grid_columns.h"
#include "core/sensor/grid_directions.h"

namespace vantage::sensor {
namespace {

constexpr int kHeaderLines = 10;
constexpr size_t kShortestPointLine = 6;  // "0 0 0\n"

absl::Status BadLine(const bytes::TextScanner& text, absl::string_view line,
                     absl::string_view expected) {
  return absl::InvalidArgumentError(absl::StrCat("PTX line ", text.line_number(), ": '",
                                                 bytes::ShownLine(line), "' where ", expected,
                                                 " was expected"));
}

struct PtxHeader {
  size_t columns = 0;
  size_t rows = 0;
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
};

absl::StatusOr<size_t> ReadCount(bytes::TextScanner& text, absl::string_view what) {
  absl::string_view line;
  std::array<double, 1> value;
  if (!text.NextLine(line)) {
    return absl::InvalidArgumentError(absl::StrCat("PTX: the file ends before ", what));
  }
  if (bytes::ParseNumbers(line, value) != 1 || value[0] != std::floor(value[0]) ||
      !(value[0] >= 0) || !(value[0] <= 1e15)) {
    return BadLine(text, line, what);
  }
  return static_cast<size_t>(value[0]);
}

absl::StatusOr<PtxHeader> ReadHeader(bytes::TextScanner& text, uint64_t size,
                                     const ImportLimits& limits) {
  PtxHeader header;
  absl::StatusOr<size_t> columns = ReadCount(text, "the number of columns");
  if (!columns.ok()) return columns.status();
  absl::StatusOr<size_t> rows = ReadCount(text, "the number of rows");
  if (!rows.ok()) return rows.status();
  header.columns = *columns;
  header.rows = *rows;
  if (header.columns < 2 || header.rows < 2) {
    return absl::InvalidArgumentError(absl::StrCat("PTX lines 1 and 2: ", header.columns,
                                                   " columns x ", header.rows,
                                                   " rows; at least 2 x 2 are needed"));
  }
  if (header.columns > limits.max_points || header.rows > limits.max_points / header.columns) {
    return absl::InvalidArgumentError(
        absl::StrCat("PTX lines 1 and 2: ", header.columns, " columns x ", header.rows,
                     " rows are more than the limit of ", limits.max_points,
                     " points; export the scan at a lower resolution"));
  }
  if (header.columns * header.rows > size / kShortestPointLine + 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("PTX: truncated: ", header.columns, " columns x ", header.rows,
                     " rows do not fit into ", size, " bytes; export or copy the file again"));
  }
  // Position and axes of the scanner (4 lines) repeat what the 4 x 4 says.
  Eigen::Matrix4d row_vector_convention;
  for (int i = 2; i < kHeaderLines; ++i) {
    const size_t wanted = i < 6 ? 3 : 4;
    absl::string_view line;
    std::array<double, 4> values;
    if (!text.NextLine(line)) return absl::InvalidArgumentError("PTX: the file ends in its header");
    const size_t count = bytes::ParseNumbers(line, values);
    bool finite = true;
    for (size_t k = 0; k < wanted; ++k) finite = finite && std::isfinite(values[k]);
    if (count != wanted || !finite) {
      return BadLine(text, line, absl::StrCat(wanted, " finite numbers"));
    }
    if (i < 6) continue;
    for (int k = 0; k < 4; ++k) row_vector_convention(i - 6, k) = values[static_cast<size_t>(k)];
  }
  const Eigen::Matrix4d matrix = row_vector_convention.transpose();
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 &&
      rotation.determinant() > 0;
  if (!rigid || !matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-6)) {
    return absl::InvalidArgumentError(
        "PTX lines 7 to 10: the 4 x 4 is not a rotation and a translation (last row: x y z 1); "
        "export without scaling");
  }
  header.T_world_scan.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  header.T_world_scan.translation() = matrix.topRightCorner<3, 1>();
  return header;
}

// What a line says of a return.
struct PtxPoint {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  // zero: no return
  AppearanceKinds has;
  double intensity = 0;  // of the whole, [0, 1]
  Colour colour{};
};

absl::StatusOr<PtxPoint> ReadPoint(const bytes::TextScanner& text, absl::string_view line,
                                   FarReturns& far) {
  std::array<double, 7> values;
  const size_t count = bytes::ParseNumbers(line, values);
  if (count != 3 && count != 4 && count != 6 && count != 7) {
    return BadLine(text, line, "x y z, intensity and colour");
  }
  const Eigen::Vector3d point(values[0], values[1], values[2]);
  if (!point.allFinite()) {
    return absl::InvalidArgumentError(absl::StrCat("PTX line ", text.line_number(),
                                                   ": NaN or infinite coordinate; a ray without a "
                                                   "return is written as 0 0 0"));
  }
  PtxPoint read;
  if (point.isZero()) return read;
  read.has = {count == 4 || count == 7, count >= 6};
  read.intensity = read.has.intensity ? values[3] : 0;
  for (size_t i = 0; i < 3 && read.has.colour; ++i) {
    read.colour[i] = ColourOf(values[count - 3 + i] / 255);
  }
  read.point = far.Near(point, [&] { return absl::StrCat("PTX line ", text.line_number()); })
                   .value_or(Eigen::Vector3f::Zero());
  return read;
}

// Collects what is wanted of it.
class PtxAppearance {
 public:
  explicit PtxAppearance(const AppearanceKinds& wanted) : wanted_(wanted) {}

  void Add(const PtxPoint& point) {
    has_.intensity = has_.intensity || point.has.intensity;
    has_.colour = has_.colour || point.has.colour;
    if (wanted_.intensity) appearance_.intensity.push_back(IntensityOf(point.intensity));
    if (wanted_.colour) appearance_.colour.push_back(point.colour);
  }
  // That any point had.
  const AppearanceKinds& has() const { return has_; }
  // What is wanted and there is, by point in the order in which they were added.
  Appearance Take() && {
    if (!has_.intensity) appearance_.intensity = {};
    if (!has_.colour) appearance_.colour = {};
    return std::move(appearance_);
  }

 private:
  AppearanceKinds wanted_;
  AppearanceKinds has_;
  Appearance appearance_;
};

// The returns of `count` lines that were read once.
absl::StatusOr<std::vector<Eigen::Vector3f>> ReturnsFrom(const bytes::ByteSource& lines,
                                                         size_t count, const ImportLimits& limits) {
  bytes::TextScanner text(lines);
  FarReturns far(limits.unit);
  std::vector<Eigen::Vector3f> returns;
  absl::string_view line;
  for (size_t i = 0; i < count && text.NextLine(line); ++i) {
    const absl::StatusOr<PtxPoint> point = ReadPoint(text, line, far);
    if (!point.ok()) return point.status();
    if (!point->point.isZero(0)) returns.push_back(point->point);
  }
  if (!text.status().ok()) return text.status();
  return returns;
}

// Goes on behind `count` lines, or at the end.
void SkipLines(bytes::TextScanner& text, size_t count) {
  absl::string_view line;
  for (size_t i = 0; i < count && text.NextLine(line); ++i) {
  }
}

}  // namespace

absl::StatusOr<std::vector<uint64_t>> FindPtxSetups(const bytes::ByteSource& file) {
  std::vector<uint64_t> begins;
  bytes::TextScanner text(file);
  while (true) {
    const uint64_t begin = text.offset();
    const absl::StatusOr<size_t> columns = ReadCount(text, "the number of columns");
    const absl::StatusOr<size_t> rows = ReadCount(text, "the number of rows");
    const uint64_t most = file.size();  // lines
    if (!columns.ok() || !rows.ok() || *columns == 0 || *rows > most / *columns) break;
    begins.push_back(begin);
    SkipLines(text, kHeaderLines - 2 + *columns * *rows);
  }
  if (!text.status().ok()) return text.status();
  if (begins.empty()) begins.push_back(0);
  begins.push_back(file.size());
  return begins;
}

absl::StatusOr<ImportedScan> ParsePtx(const bytes::ByteSource& file, const ImportLimits& limits) {
  bytes::TextScanner text(file);
  absl::StatusOr<PtxHeader> header = ReadHeader(text, file.size(), limits);
  if (!header.ok()) return header.status();
  const size_t count = header->columns * header->rows;
  const uint64_t begin = text.offset();
  KnownGrid points(header->columns, header->rows, limits.appearance.any());
  PtxAppearance appearance(limits.appearance);
  uint32_t returns = 0;
  FarReturns far(limits.unit);
  absl::string_view line;
  for (size_t i = 0; i < count; ++i) {
    if (!text.NextLine(line)) {
      if (!text.status().ok()) return text.status();
      return absl::InvalidArgumentError(
          absl::StrCat("PTX: truncated: ", i, " points where ", count,
                       " were announced; export or copy the file again"));
    }
    absl::StatusOr<PtxPoint> point = ReadPoint(text, line, far);
    if (!point.ok()) {
      if (text.offset() < file.size()) return point.status();
      return absl::InvalidArgumentError(
          absl::StrCat(point.status().message(), "; the file ends there (truncated?)"));
    }
    if (point->point.isZero(0)) continue;
    appearance.Add(*point);
    points.Put(i / header->rows, i % header->rows, point->point, returns++);
  }
  while (text.NextLine(line)) {
    if (absl::StripAsciiWhitespace(line).empty()) continue;
    std::array<double, 1> next_columns;
    if (bytes::ParseNumbers(line, next_columns) == 1) {
      return absl::UnimplementedError(absl::StrCat(
          "PTX line ", text.line_number(), ": a second scan begins here, and one is asked for"));
    }
    return absl::InvalidArgumentError(absl::StrCat("PTX line ", text.line_number(), ": '",
                                                   bytes::ShownLine(line), "' after the ", count,
                                                   " points that were announced"));
  }
  if (absl::Status near = far.Check(); !near.ok()) return near;
  if (points.empty()) {
    return absl::InvalidArgumentError(
        "points: no ray of the scan returned anything; there is nothing to model");
  }
  std::optional<absl::StatusOr<GriddedScan>> gridded = points.ToScan();
  if (!gridded.has_value()) {
    const auto again = ReturnsFrom(file.Part(begin, file.size() - begin), count, limits);
    if (!again.ok()) return again.status();
    gridded = GridDirections(*again, points.leaning());
  }
  if (!gridded->ok()) return gridded->status();
  const AppearanceKinds has = appearance.has();
  absl::StatusOr<ImportedScan> scan =
      FinishImport(**std::move(gridded), count, limits, std::move(appearance).Take());
  if (!scan.ok()) return scan.status();
  scan->appearance = has;
  scan->far = far.count();
  if (!header->T_world_scan.isApprox(Eigen::Isometry3d::Identity(), 1e-12)) {
    scan->T_world_scan = header->T_world_scan;
    scan->T_world_scan->translation() *= limits.unit;
  }
  return scan;
}

}  // namespace vantage::sensor
