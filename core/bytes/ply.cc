#include "core/bytes/ply.h"

#include <array>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace vantage::bytes {
namespace {

struct TypeInfo {
  const char* name;
  const char* sized_name;
  size_t size;
};
// In the order of PlyType.
constexpr std::array<TypeInfo, 8> kTypes = {{{"char", "int8", 1},
                                             {"uchar", "uint8", 1},
                                             {"short", "int16", 2},
                                             {"ushort", "uint16", 2},
                                             {"int", "int32", 4},
                                             {"uint", "uint32", 4},
                                             {"float", "float32", 4},
                                             {"double", "float64", 8}}};

std::optional<size_t> FindLast(const PlyElement& element, absl::string_view name, bool list) {
  for (size_t i = element.properties.size(); i-- > 0;) {
    const PlyProperty& property = element.properties[i];
    if (property.name == name && property.count_type.has_value() == list) return i;
  }
  return std::nullopt;
}

}  // namespace

size_t PlyTypeSize(PlyType type) { return kTypes[static_cast<size_t>(type)].size; }

absl::string_view PlyTypeName(PlyType type) { return kTypes[static_cast<size_t>(type)].name; }

std::optional<PlyType> FindPlyType(absl::string_view name) {
  for (size_t i = 0; i < kTypes.size(); ++i) {
    if (name == kTypes[i].name || name == kTypes[i].sized_name) return static_cast<PlyType>(i);
  }
  return std::nullopt;
}

std::optional<size_t> PlyElement::FindScalar(absl::string_view property) const {
  return FindLast(*this, property, false);
}

std::optional<size_t> PlyElement::FindList(absl::string_view property) const {
  return FindLast(*this, property, true);
}

absl::StatusOr<std::array<size_t, 3>> PlyElement::FindPosition() const {
  const std::optional<size_t> x = FindScalar("x");
  const std::optional<size_t> y = FindScalar("y");
  const std::optional<size_t> z = FindScalar("z");
  if (x.has_value() && y.has_value() && z.has_value()) return std::array<size_t, 3>{*x, *y, *z};
  return absl::InvalidArgumentError(
      absl::StrCat("PLY element ", name, ": properties x, y and z are needed"));
}

}  // namespace vantage::bytes
