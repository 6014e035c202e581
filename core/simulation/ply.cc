// PLY files.
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/sensor/byte_order.h"
#include "core/sensor/text_scanner.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage {
namespace {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

bool ParseType(absl::string_view name, PlyType& type) {
  struct Name {
    const char* name;
    PlyType type;
  };
  static constexpr std::array<Name, 16> kNames = {{{"char", PlyType::kInt8},
                                                   {"int8", PlyType::kInt8},
                                                   {"uchar", PlyType::kUint8},
                                                   {"uint8", PlyType::kUint8},
                                                   {"short", PlyType::kInt16},
                                                   {"int16", PlyType::kInt16},
                                                   {"ushort", PlyType::kUint16},
                                                   {"uint16", PlyType::kUint16},
                                                   {"int", PlyType::kInt32},
                                                   {"int32", PlyType::kInt32},
                                                   {"uint", PlyType::kUint32},
                                                   {"uint32", PlyType::kUint32},
                                                   {"float", PlyType::kFloat},
                                                   {"float32", PlyType::kFloat},
                                                   {"double", PlyType::kDouble},
                                                   {"float64", PlyType::kDouble}}};
  for (const Name& known : kNames) {
    if (name == known.name) {
      type = known.type;
      return true;
    }
  }
  return false;
}

size_t SizeOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kInt32:
    case PlyType::kUint32:
    case PlyType::kFloat:
      return 4;
    case PlyType::kDouble:
      return 8;
  }
  return 8;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  bool list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  bool ascii = false;
  std::vector<PlyElement> elements;
  size_t data_offset = 0;
};

// The values of the file's body, one after another.
class PlyValues {
 public:
  PlyValues(absl::string_view data, bool ascii) : data_(data), ascii_(ascii) {}

  // False at the end of the data or where no number is.
  bool Next(PlyType type, double& value) {
    if (!ascii_) {
      const size_t size = SizeOf(type);
      if (data_.size() - at_ < size) return false;
      value = Load(type, data_.data() + at_);
      at_ += size;
      return true;
    }
    while (at_ < data_.size() && absl::ascii_isspace(data_[at_])) ++at_;
    const size_t begin = at_;
    while (at_ < data_.size() && !absl::ascii_isspace(data_[at_])) ++at_;
    std::array<double, 1> number;
    if (ParseNumbers(data_.substr(begin, at_ - begin), number) != 1) return false;
    value = number[0];
    return true;
  }
  size_t left() const { return data_.size() - at_; }

 private:
  static double Load(PlyType type, const char* at) {
    switch (type) {
      case PlyType::kInt8:
        return LoadLittleEndian<int8_t>(at);
      case PlyType::kUint8:
        return LoadLittleEndian<uint8_t>(at);
      case PlyType::kInt16:
        return LoadLittleEndian<int16_t>(at);
      case PlyType::kUint16:
        return LoadLittleEndian<uint16_t>(at);
      case PlyType::kInt32:
        return LoadLittleEndian<int32_t>(at);
      case PlyType::kUint32:
        return LoadLittleEndian<uint32_t>(at);
      case PlyType::kFloat:
        return static_cast<double>(LoadLittleEndian<float>(at));
      case PlyType::kDouble:
        return LoadLittleEndian<double>(at);
    }
    return 0;
  }

  absl::string_view data_;
  bool ascii_;
  size_t at_ = 0;
};

absl::Status BadHeaderLine(const TextScanner& text, absl::string_view line) {
  return absl::InvalidArgumentError(
      absl::StrCat("PLY line ", text.line_number(), ": '", Shown(line), "' is not understood"));
}

absl::StatusOr<PlyHeader> ReadHeader(absl::string_view bytes) {
  constexpr size_t kMaxHeaderLines = 1000;
  TextScanner text(bytes);
  absl::string_view line;
  if (!text.NextLine(line) || line != "ply") {
    return absl::InvalidArgumentError("PLY: the first line is not 'ply'; is this a PLY file?");
  }
  PlyHeader header;
  bool format_known = false;
  while (text.NextLine(line) && text.line_number() <= kMaxHeaderLines) {
    const std::vector<absl::string_view> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t"), absl::SkipEmpty());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      if (!format_known) return absl::InvalidArgumentError("PLY: the header states no format");
      header.data_offset = text.offset();
      return header;
    }
    if (words[0] == "format" && words.size() >= 2) {
      if (words[1] == "binary_big_endian") {
        return absl::UnimplementedError(
            "PLY: binary_big_endian is not read; save as binary_little_endian");
      }
      if (words[1] != "ascii" && words[1] != "binary_little_endian") {
        return BadHeaderLine(text, line);
      }
      header.ascii = words[1] == "ascii";
      format_known = true;
    } else if (words[0] == "element" && words.size() == 3) {
      PlyElement element;
      element.name = std::string(words[1]);
      if (!absl::SimpleAtoi(words[2], &element.count)) return BadHeaderLine(text, line);
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && !header.elements.empty() &&
               (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
      PlyProperty property;
      property.name = std::string(words.back());
      property.list = words.size() == 5;
      if (!ParseType(words[words.size() - 2], property.type) ||
          (property.list && !ParseType(words[2], property.count_type))) {
        return BadHeaderLine(text, line);
      }
      header.elements.back().properties.push_back(std::move(property));
    } else {
      return BadHeaderLine(text, line);
    }
  }
  return absl::InvalidArgumentError("PLY: no end_header; is this a PLY file?");
}

absl::Status Truncated(const PlyElement& element, uint64_t index) {
  return absl::InvalidArgumentError(absl::StrCat("PLY element ", element.name, " ", index, " of ",
                                                 element.count,
                                                 ": no number there; the file is truncated or "
                                                 "damaged"));
}

// The least bytes that an element can take.
size_t LeastBytes(const PlyElement& element, bool ascii) {
  size_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    bytes += ascii ? 2 : SizeOf(property.list ? property.count_type : property.type);
  }
  return bytes;
}

absl::Status AddFace(const std::vector<double>& corners, uint64_t index, TriangleMesh& mesh) {
  const auto count = static_cast<double>(mesh.vertices.size());
  for (const double corner : corners) {
    if (!(corner >= 0 && corner < count) || corner != std::floor(corner)) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY face ", index, ": vertex ", corner, " of ", mesh.vertices.size()));
    }
  }
  for (size_t k = 2; k < corners.size(); ++k) {
    const std::array<uint32_t, 3> triangle = {static_cast<uint32_t>(corners[0]),
                                              static_cast<uint32_t>(corners[k - 1]),
                                              static_cast<uint32_t>(corners[k])};
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]];
    const Eigen::Vector3f& b = mesh.vertices[triangle[1]];
    const Eigen::Vector3f& c = mesh.vertices[triangle[2]];
    if (!((b - a).cross(c - a).norm() > 0)) continue;
    mesh.triangles.push_back(triangle);
  }
  return absl::OkStatus();
}

// Reads one element's instances; vertices and faces go to the mesh, everything else is skipped.
absl::Status ReadElement(const PlyElement& element, bool ascii, PlyValues& values,
                         TriangleMesh& mesh) {
  constexpr size_t kNone = std::numeric_limits<size_t>::max();
  const bool vertices = element.name == "vertex";
  const bool faces = element.name == "face";
  const size_t least = LeastBytes(element, ascii);
  if (element.count > 0 && least == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY element ", element.name, ": it has no properties"));
  }
  if (element.count > 0 && element.count > (values.left() + 1) / least) {
    return absl::InvalidArgumentError(absl::StrCat("PLY element ", element.name, ": ",
                                                   element.count, " do not fit into the ",
                                                   values.left(), " bytes left; truncated?"));
  }
  if (vertices && element.count > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat("PLY: ", element.count, " vertices"));
  }
  std::array<size_t, 3> xyz = {kNone, kNone, kNone};
  size_t indices = kNone;
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (property.list) {
      if (property.name == "vertex_indices" || property.name == "vertex_index") indices = i;
      continue;
    }
    if (property.name == "x") xyz[0] = i;
    if (property.name == "y") xyz[1] = i;
    if (property.name == "z") xyz[2] = i;
  }
  if (vertices && (xyz[0] == kNone || xyz[1] == kNone || xyz[2] == kNone)) {
    return absl::InvalidArgumentError("PLY element vertex: properties x, y and z are needed");
  }
  if (faces && indices == kNone) {
    return absl::InvalidArgumentError("PLY element face: a list vertex_indices is needed");
  }
  std::vector<double> corners;
  for (uint64_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      double value = 0;
      if (!property.list) {
        if (!values.Next(property.type, value)) return Truncated(element, i);
        for (size_t axis = 0; axis < 3; ++axis) {
          if (xyz[axis] == p) point[static_cast<Eigen::Index>(axis)] = value;
        }
        continue;
      }
      double count = 0;
      if (!values.Next(property.count_type, count)) return Truncated(element, i);
      if (!(count >= 0) || count != std::floor(count) ||
          count > static_cast<double>(values.left())) {
        return Truncated(element, i);
      }
      if (p == indices) corners.clear();
      for (double k = 0; k < count; ++k) {
        if (!values.Next(property.type, value)) return Truncated(element, i);
        if (p == indices) corners.push_back(value);
      }
    }
    if (vertices) {
      const Eigen::Vector3f vertex = point.cast<float>();
      if (!vertex.allFinite()) {
        return absl::InvalidArgumentError(
            absl::StrCat("PLY vertex ", i, ": NaN or infinite coordinate"));
      }
      mesh.vertices.push_back(vertex);
    }
    if (faces) {
      if (absl::Status added = AddFace(corners, i, mesh); !added.ok()) return added;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TriangleMesh> ParsePly(absl::string_view bytes) {
  absl::StatusOr<PlyHeader> header = ReadHeader(bytes);
  if (!header.ok()) return header.status();
  PlyValues values(bytes.substr(header->data_offset), header->ascii);
  TriangleMesh mesh;
  for (const PlyElement& element : header->elements) {
    if (absl::Status read = ReadElement(element, header->ascii, values, mesh); !read.ok()) {
      return read;
    }
  }
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("PLY: no triangle with an area; is it a point cloud?");
  }
  mesh.material.assign(mesh.triangles.size(), Material::kMatte);
  return mesh;
}

absl::StatusOr<TriangleMesh> ReadPly(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::ErrnoToStatus(errno == 0 ? EIO : errno, absl::StrCat(path, ": open"));
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) return absl::DataLossError(absl::StrCat(path, ": reading failed"));
  absl::StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  if (mesh.ok()) return mesh;
  return absl::Status(mesh.status().code(), absl::StrCat(path, ": ", mesh.status().message()));
}

}  // namespace vantage
