#include "client/picture/surface_ply.h"

#include <array>
#include <cstring>
#include <map>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace vantage {
namespace {

struct Property {
  char type = 'f';  // i: signed, u: unsigned, f: floating point
  size_t size = 4;  // bytes
  size_t offset = 0;
};

struct Header {
  size_t vertices = 0;
  size_t stride = 0;
  size_t end = 0;  // where the vertices begin
  std::map<std::string, Property> properties;
};

absl::Status Bad(const std::string& why) {
  return absl::InvalidArgumentError(absl::StrCat("surface PLY: ", why));
}

bool TypeOf(const std::string& name, Property& property) {
  static constexpr std::array<std::pair<const char*, std::pair<char, size_t>>, 16> kTypes = {{
      {"char", {'i', 1}},
      {"int8", {'i', 1}},
      {"uchar", {'u', 1}},
      {"uint8", {'u', 1}},
      {"short", {'i', 2}},
      {"int16", {'i', 2}},
      {"ushort", {'u', 2}},
      {"uint16", {'u', 2}},
      {"int", {'i', 4}},
      {"int32", {'i', 4}},
      {"uint", {'u', 4}},
      {"uint32", {'u', 4}},
      {"float", {'f', 4}},
      {"float32", {'f', 4}},
      {"double", {'f', 8}},
      {"float64", {'f', 8}},
  }};
  for (const auto& [known, type] : kTypes) {
    if (name != known) continue;
    property.type = type.first;
    property.size = type.second;
    return true;
  }
  return false;
}

absl::StatusOr<Header> ParseHeader(absl::string_view bytes) {
  const absl::string_view kEnd = "end_header\n";
  const size_t end = bytes.find(kEnd);
  if (bytes.substr(0, 4) != "ply\n" || end == absl::string_view::npos) {
    return Bad("not a PLY file");
  }
  Header header;
  header.end = end + kEnd.size();
  std::string element;
  bool binary = false;
  for (const absl::string_view line : absl::StrSplit(bytes.substr(0, end), '\n')) {
    const std::vector<std::string> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    if (words.size() >= 2 && words[0] == "format") binary = words[1] == "binary_little_endian";
    if (words.size() == 3 && words[0] == "element") {
      element = words[1];
      if (element == "vertex" && !absl::SimpleAtoi(words[2], &header.vertices)) {
        return Bad(absl::StrCat("'", words[2], "' vertices"));
      }
      if (element != "vertex" && header.stride == 0) return Bad("vertices do not come first");
    }
    if (words.size() >= 3 && words[0] == "property" && element == "vertex") {
      Property property;
      if (!TypeOf(words[1], property)) return Bad(absl::StrCat("a vertex has a ", words[1]));
      property.offset = header.stride;
      header.stride += property.size;
      header.properties[words[2]] = property;
    }
  }
  if (!binary) return Bad("not binary_little_endian");
  if (header.stride == 0 || (bytes.size() - header.end) / header.stride < header.vertices) {
    return Bad(absl::StrCat("truncated: ", header.vertices, " vertices announced"));
  }
  return header;
}

template <typename T>
double As(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(value));
  return static_cast<double>(value);
}

double Read(const char* vertex, const Property& p) {
  const char* at = vertex + p.offset;
  switch (p.size) {
    case 1:
      return p.type == 'i' ? As<int8_t>(at) : As<uint8_t>(at);
    case 2:
      return p.type == 'i' ? As<int16_t>(at) : As<uint16_t>(at);
    case 4:
      return p.type == 'f' ? As<float>(at) : p.type == 'i' ? As<int32_t>(at) : As<uint32_t>(at);
    default:
      return As<double>(at);
  }
}

}  // namespace

absl::StatusOr<std::vector<SurfaceElement>> ParseSurfacePly(absl::string_view bytes) {
  const auto header = ParseHeader(bytes);
  if (!header.ok()) return header.status();
  static constexpr std::array<const char*, 9> kNeeded = {"x",  "y",    "z",       "nx",  "ny",
                                                         "nz", "kind", "density", "area"};
  std::array<Property, kNeeded.size()> at;
  for (size_t i = 0; i < kNeeded.size(); ++i) {
    const auto found = header->properties.find(kNeeded[i]);
    if (found == header->properties.end()) {
      return Bad(absl::StrCat("vertices have no '", kNeeded[i], "'"));
    }
    at[i] = found->second;
  }
  std::vector<SurfaceElement> elements;
  elements.reserve(header->vertices);
  for (size_t v = 0; v < header->vertices; ++v) {
    const char* vertex = bytes.data() + header->end + v * header->stride;
    std::array<float, kNeeded.size()> value;
    for (size_t i = 0; i < at.size(); ++i) value[i] = static_cast<float>(Read(vertex, at[i]));
    if (!(value[6] >= 0 && value[6] < kSurfaceKinds)) {
      return Bad(absl::StrCat("vertex ", v, " has kind ", value[6]));
    }
    elements.push_back({{value[0], value[1], value[2]},
                        {value[3], value[4], value[5]},
                        static_cast<SurfaceKind>(static_cast<int>(value[6])),
                        value[8],
                        value[7]});
  }
  return elements;
}

}  // namespace vantage
