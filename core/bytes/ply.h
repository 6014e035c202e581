// The header of a PLY file: elements, and the properties that each of their instances has.
#ifndef VANTAGE_CORE_BYTES_PLY_H_
#define VANTAGE_CORE_BYTES_PLY_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

size_t PlyTypeSize(PlyType type);                            // bytes
absl::string_view PlyTypeName(PlyType type);                 // char, uchar, short, ...
std::optional<PlyType> FindPlyType(absl::string_view name);  // both char and int8, ...

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  // The type that a list's length is written as; absent where the property is no list.
  std::optional<PlyType> count_type = std::nullopt;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;

  // The index in `properties` of the one of this name; the last of several.
  std::optional<size_t> FindScalar(absl::string_view property) const;
  std::optional<size_t> FindList(absl::string_view property) const;
  // Those of x, y and z. INVALID_ARGUMENT: there are not all of them.
  absl::StatusOr<std::array<size_t, 3>> FindPosition() const;
};

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_PLY_H_
