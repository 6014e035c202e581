#include "core/sensor/pcd.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/lzf.h"
#include "core/bytes/text_scanner.h"
#include "core/sensor/grid_columns.h"
#include "core/sensor/grid_directions.h"

namespace vantage::sensor {
namespace {

struct PcdField {
  std::string name;
  size_t size = 4;   // bytes of one value
  char type = 'F';   // F, I or U
  size_t count = 1;  // values per point
  size_t bytes() const { return size * count; }
};

struct PcdHeader {
  std::vector<PcdField> fields;
  uint64_t width = 0;
  uint64_t height = 1;
  uint64_t points = 0;
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  std::string data;  // ascii, binary or binary_compressed
  size_t data_offset = 0;
  std::array<size_t, 3> xyz{};                       // index of each coordinate's field
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, of projection, in the points' frame

  size_t PointBytes() const {
    size_t bytes = 0;
    for (const PcdField& field : fields) bytes += field.bytes();
    return bytes;
  }
};

absl::Status BadEntry(absl::string_view key, absl::string_view value, absl::string_view expected) {
  return absl::InvalidArgumentError(absl::StrCat("PCD ", key, ": '", bytes::ShownLine(value),
                                                 "' where ", expected, " was expected"));
}

constexpr size_t kMaxFields = 256;
constexpr size_t kMaxValuesPerPoint = 4096;

absl::Status ReadViewpoint(absl::string_view value, PcdHeader& header) {
  std::array<double, 7> v;
  if (bytes::ParseNumbers(value, v) != 7)
    return BadEntry("VIEWPOINT", value, "tx ty tz qw qx qy qz");
  const Eigen::Vector3d translation(v[0], v[1], v[2]);
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  if (!translation.allFinite() || !(std::abs(rotation.norm() - 1) < 1e-2)) {
    return BadEntry("VIEWPOINT", value, "a finite position and a unit quaternion (w first)");
  }
  header.T_world_scan.linear() = rotation.normalized().toRotationMatrix();
  header.T_world_scan.translation() = translation;
  return absl::OkStatus();
}

// One "KEY value..." line. FIELDS has come before SIZE, TYPE and COUNT.
absl::Status ReadEntry(absl::string_view key, absl::string_view value, PcdHeader& header) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(value, absl::ByAnyChar(" \t"), absl::SkipEmpty());
  if (key == "VERSION") {
    if (value != "0.7" && value != ".7" && value != "0.6" && value != ".6") {
      return absl::UnimplementedError(absl::StrCat("PCD VERSION ", bytes::ShownLine(value),
                                                   " is not read; save the cloud as 0.7"));
    }
    return absl::OkStatus();
  }
  if (key == "FIELDS" || key == "COLUMNS") {
    if (words.empty() || words.size() > kMaxFields) return BadEntry(key, value, "names of fields");
    header.fields.clear();
    for (const absl::string_view name : words) header.fields.push_back({std::string(name)});
    return absl::OkStatus();
  }
  if (key == "SIZE" || key == "TYPE" || key == "COUNT") {
    if (words.size() != header.fields.size()) {
      return BadEntry(key, value,
                      absl::StrCat("one entry for each of the ", header.fields.size(), " FIELDS"));
    }
    for (size_t i = 0; i < words.size(); ++i) {
      PcdField& field = header.fields[i];
      if (key == "TYPE") {
        if (words[i] != "F" && words[i] != "I" && words[i] != "U") {
          return BadEntry(key, value, "F, I or U");
        }
        field.type = words[i][0];
        continue;
      }
      uint32_t number = 0;
      const bool read = absl::SimpleAtoi(words[i], &number);
      if (key == "SIZE") {
        if (!read || (number != 1 && number != 2 && number != 4 && number != 8)) {
          return BadEntry(key, value, "1, 2, 4 or 8");
        }
        field.size = number;
      } else {
        if (!read || number > kMaxValuesPerPoint) {
          return BadEntry(key, value, absl::StrCat("at most ", kMaxValuesPerPoint));
        }
        field.count = number;
      }
    }
    return absl::OkStatus();
  }
  if (key == "WIDTH" || key == "HEIGHT" || key == "POINTS") {
    uint64_t number = 0;
    if (words.size() != 1 || !absl::SimpleAtoi(words[0], &number)) {
      return BadEntry(key, value, "a number of points");
    }
    (key == "WIDTH" ? header.width : key == "HEIGHT" ? header.height : header.points) = number;
    return absl::OkStatus();
  }
  if (key == "VIEWPOINT") return ReadViewpoint(value, header);
  if (key == "DATA") {
    header.data = std::string(value);
    if (value == "ascii" || value == "binary" || value == "binary_compressed") {
      return absl::OkStatus();
    }
    return absl::UnimplementedError(
        absl::StrCat("PCD DATA ", bytes::ShownLine(value),
                     " is not read; use ascii, binary or binary_compressed"));
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "PCD: '", bytes::ShownLine(key), "' is not an entry of a PCD header; is this a PCD file?"));
}

absl::Status CheckHeader(const ImportLimits& limits, PcdHeader& header) {
  if (header.width == 0 || header.height == 0) {
    return absl::InvalidArgumentError(absl::StrCat("PCD WIDTH ", header.width, " and HEIGHT ",
                                                   header.height, ": the cloud is empty"));
  }
  if (header.width > limits.max_points || header.height > limits.max_points / header.width) {
    return absl::InvalidArgumentError(absl::StrCat(
        "PCD WIDTH ", header.width, " and HEIGHT ", header.height, ": more than the limit of ",
        limits.max_points, " points; export the scan at a lower resolution"));
  }
  if (header.points != header.width * header.height) {
    return absl::InvalidArgumentError(absl::StrCat("PCD POINTS ", header.points, " is not WIDTH ",
                                                   header.width, " times HEIGHT ", header.height));
  }
  constexpr std::array<absl::string_view, 3> kNames = {"x", "y", "z"};
  for (size_t axis = 0; axis < 3; ++axis) {
    size_t found = header.fields.size();
    for (size_t i = 0; i < header.fields.size(); ++i) {
      if (kNames[axis] == absl::string_view(header.fields[i].name)) found = i;
    }
    if (found == header.fields.size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("PCD FIELDS: no field ", kNames[axis], "; x, y and z are needed"));
    }
    const PcdField& field = header.fields[found];
    if (field.type != 'F' || (field.size != 4 && field.size != 8) || field.count != 1) {
      return absl::InvalidArgumentError(
          absl::StrCat("PCD TYPE, SIZE, COUNT of ", kNames[axis], ": must be F, 4 or 8, and 1"));
    }
    header.xyz[axis] = found;
  }
  size_t values = 0;
  for (const PcdField& field : header.fields) values += field.count;
  if (values > kMaxValuesPerPoint) {
    return absl::InvalidArgumentError(absl::StrCat(
        "PCD COUNT: ", values, " values per point are more than ", kMaxValuesPerPoint));
  }
  return absl::OkStatus();
}

absl::StatusOr<PcdHeader> ReadHeader(absl::string_view bytes, const ImportLimits& limits) {
  constexpr size_t kMaxHeaderLines = 1000;
  PcdHeader header;
  bytes::TextScanner text(bytes);
  absl::string_view line;
  while (header.data.empty()) {
    if (!text.NextLine(line) || text.line_number() > kMaxHeaderLines) {
      return absl::InvalidArgumentError("PCD: no DATA entry; is this a PCD file?");
    }
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || line.front() == '#') continue;
    const size_t space = line.find_first_of(" \t");
    const absl::string_view key = line.substr(0, space);
    const absl::string_view value =
        space == absl::string_view::npos ? "" : absl::StripAsciiWhitespace(line.substr(space));
    if (absl::Status read = ReadEntry(key, value, header); !read.ok()) return read;
  }
  header.data_offset = text.offset();
  if (absl::Status good = CheckHeader(limits, header); !good.ok()) return good;
  return header;
}

absl::Status Truncated(const PcdHeader& header, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("PCD: truncated: ", what, " for ", header.points,
                                                 " points; export or copy the file again"));
}

double LoadFloat(const char* bytes, size_t size) {
  return size == 4 ? static_cast<double>(bytes::LoadLittleEndian<float>(bytes))
                   : bytes::LoadLittleEndian<double>(bytes);
}

// Takes a point, or says what is wrong with it. Of an organised cloud NaN is no return.
absl::Status AddPoint(const Eigen::Vector3d& point, const PcdHeader& header, FarReturns& far,
                      std::vector<Eigen::Vector3f>& points) {
  const bool organised = header.height > 1;
  if (organised && point.array().isNaN().all()) {
    points.push_back(Eigen::Vector3f::Zero());
    return absl::OkStatus();
  }
  if (!point.allFinite()) {
    return absl::InvalidArgumentError(
        absl::StrCat("PCD point ", points.size(),
                     ": NaN or infinite coordinate; remove invalid points, or keep ",
                     "the cloud organised, where all three NaN mean no return"));
  }
  if (organised && point.isZero(0)) {
    points.push_back(Eigen::Vector3f::Zero());
    return absl::OkStatus();
  }
  const Eigen::Vector3d seen = point - header.centre;
  if (seen.isZero()) {
    points.push_back(Eigen::Vector3f::Zero());
    return absl::OkStatus();
  }
  points.push_back(far.Near(seen, [&] { return absl::StrCat("PCD point ", points.size()); })
                       .value_or(Eigen::Vector3f::Zero()));
  return absl::OkStatus();
}

absl::Status ReadAscii(absl::string_view data, const PcdHeader& header, FarReturns& far,
                       std::vector<Eigen::Vector3f>& points) {
  size_t values_per_point = 0;
  std::array<size_t, 3> column{};
  for (size_t i = 0; i < header.fields.size(); ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (header.xyz[axis] == i) column[axis] = values_per_point;
    }
    values_per_point += header.fields[i].count;
  }
  if (header.points > data.size() / (2 * values_per_point) + 1) {
    return Truncated(header, absl::StrCat(data.size(), " bytes of ascii"));
  }
  points.reserve(header.points);
  std::vector<double> values(values_per_point);
  bytes::TextScanner text(data);
  absl::string_view line;
  while (points.size() < header.points) {
    if (!text.NextLine(line)) return Truncated(header, absl::StrCat(points.size(), " lines"));
    if (bytes::ParseNumbers(line, values) != values_per_point) {
      return absl::InvalidArgumentError(absl::StrCat("PCD point ", points.size(), ": '",
                                                     bytes::ShownLine(line), "' where ",
                                                     values_per_point, " numbers were expected"));
    }
    const Eigen::Vector3d point(values[column[0]], values[column[1]], values[column[2]]);
    if (absl::Status added = AddPoint(point, header, far, points); !added.ok()) return added;
  }
  return absl::OkStatus();
}

// `stride[axis]` bytes from one point's coordinate to the next, the first at `offset[axis]`.
absl::Status ReadBinary(absl::string_view data, const PcdHeader& header,
                        const std::array<size_t, 3>& offset, const std::array<size_t, 3>& stride,
                        FarReturns& far, std::vector<Eigen::Vector3f>& points) {
  points.reserve(header.points);
  for (size_t i = 0; i < header.points; ++i) {
    Eigen::Vector3d point;
    for (size_t axis = 0; axis < 3; ++axis) {
      point[static_cast<Eigen::Index>(axis)] = LoadFloat(
          data.data() + offset[axis] + i * stride[axis], header.fields[header.xyz[axis]].size);
    }
    if (absl::Status added = AddPoint(point, header, far, points); !added.ok()) return added;
  }
  return absl::OkStatus();
}

absl::Status ReadInterleaved(absl::string_view data, const PcdHeader& header, FarReturns& far,
                             std::vector<Eigen::Vector3f>& points) {
  const size_t point_bytes = header.PointBytes();
  if (data.size() / point_bytes < header.points) {
    return Truncated(header, absl::StrCat(data.size(), " bytes"));
  }
  std::array<size_t, 3> offset{};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < header.xyz[axis]; ++i) offset[axis] += header.fields[i].bytes();
  }
  return ReadBinary(data, header, offset, {point_bytes, point_bytes, point_bytes}, far, points);
}

// Two lengths, then an LZF block that holds all values of the first field, then the second, ...
absl::Status ReadCompressed(absl::string_view data, const PcdHeader& header, FarReturns& far,
                            std::vector<Eigen::Vector3f>& points) {
  if (data.size() < 8) return Truncated(header, absl::StrCat(data.size(), " bytes"));
  const size_t packed = bytes::LoadLittleEndian<uint32_t>(data.data());
  const size_t unpacked = bytes::LoadLittleEndian<uint32_t>(data.data() + 4);
  if (packed > data.size() - 8) {
    return Truncated(header, absl::StrCat(data.size() - 8, " of ", packed, " compressed bytes"));
  }
  if (unpacked != header.PointBytes() * header.points) {
    return absl::InvalidArgumentError(absl::StrCat("PCD: ", unpacked, " uncompressed bytes where ",
                                                   header.points, " points take ",
                                                   header.PointBytes() * header.points));
  }
  absl::StatusOr<std::string> values = bytes::DecompressLzf(data.substr(8, packed), unpacked);
  if (!values.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("PCD DATA binary_compressed: ", values.status().message()));
  }
  std::array<size_t, 3> offset{};
  std::array<size_t, 3> stride{};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < header.xyz[axis]; ++i) {
      offset[axis] += header.fields[i].bytes() * header.points;
    }
    stride[axis] = header.fields[header.xyz[axis]].size;
  }
  return ReadBinary(*values, header, offset, stride, far, points);
}

}  // namespace

absl::StatusOr<ImportedScan> ParsePcd(absl::string_view bytes, const ImportLimits& limits,
                                      const std::optional<Eigen::Vector3d>& station) {
  absl::StatusOr<PcdHeader> header = ReadHeader(bytes, limits);
  if (!header.ok()) return header.status();
  if (station.has_value()) {
    header->centre = *station;
    header->T_world_scan = Eigen::Isometry3d(Eigen::Translation3d(*station));
  }
  const absl::string_view data = bytes.substr(header->data_offset);
  std::vector<Eigen::Vector3f> points;
  FarReturns far(limits.unit);
  absl::Status read = header->data == "ascii"    ? ReadAscii(data, *header, far, points)
                      : header->data == "binary" ? ReadInterleaved(data, *header, far, points)
                                                 : ReadCompressed(data, *header, far, points);
  if (!read.ok()) return read;
  if (absl::Status near = far.Check(); !near.ok()) return near;
  // Organised clouds are stored row after row: their rows are taken as the grid's columns here, and
  // gridding finds out which of the two share an azimuth.
  absl::StatusOr<GriddedScan> gridded = header->height > 1 && header->width > 1
                                            ? GridColumns(points, header->height, header->width)
                                            : GridDirections(points);
  const bool from_elsewhere = !station.has_value() && !header->T_world_scan.translation().isZero(0);
  if (from_elsewhere && (!gridded.ok() || gridded->resampled)) {
    const Eigen::Vector3d viewpoint = header->T_world_scan.translation();
    const absl::StatusOr<ImportedScan> in_world = ParsePcd(bytes, limits, viewpoint);
    if (in_world.ok() && !in_world->resampled) {
      return absl::InvalidArgumentError(absl::StrCat(
          "PCD VIEWPOINT: seen from there the points form a grid, and seen from the origin none: "
          "they are in the world's frame, not in the scanner's; give the station (--station ",
          viewpoint.x(), ",", viewpoint.y(), ",", viewpoint.z(), ")"));
    }
  }
  if (!gridded.ok()) return gridded.status();
  absl::StatusOr<ImportedScan> scan = FinishImport(*std::move(gridded), header->points, limits);
  if (!scan.ok()) return scan.status();
  scan->far = far.count();
  if (!header->T_world_scan.isApprox(Eigen::Isometry3d::Identity(), 1e-12)) {
    scan->T_world_scan = header->T_world_scan;
    scan->T_world_scan->translation() *= limits.unit;
  }
  return scan;
}

}  // namespace vantage::sensor
