#include "core/bytes/ply_writer.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace vantage::bytes {

std::string EncodePlyHeader(absl::string_view comment, const std::vector<PlyElement>& elements) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const absl::string_view line : absl::StrSplit(comment, '\n')) {
    absl::StrAppend(&header, "comment ", line, "\n");
  }
  for (const PlyElement& element : elements) {
    absl::StrAppend(&header, "element ", element.name, " ", element.count, "\n");
    for (const PlyProperty& property : element.properties) {
      absl::StrAppend(&header, "property ");
      if (property.count_type.has_value()) {
        absl::StrAppend(&header, "list ", PlyTypeName(*property.count_type), " ");
      }
      absl::StrAppend(&header, PlyTypeName(property.type), " ", property.name, "\n");
    }
  }
  return header + "end_header\n";
}

}  // namespace vantage::bytes
