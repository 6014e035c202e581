// What is in an E57 file: its set-ups, each with its pose and the records of its points (ASTM
// E2807, section 8.4: data3D).
#ifndef VANTAGE_CORE_E57_INDEX_H_
#define VANTAGE_CORE_E57_INDEX_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/e57/paged_bytes.h"

namespace vantage::e57 {

enum class FieldType { kInteger, kScaledInteger, kFloat, kDouble, kString };

// A number of each record, as the prototype of the records says that it is stored.
struct Field {
  std::string name;  // of the standard, e.g. "cartesianX", or of an extension, e.g. "nor:normalX"
  FieldType type = FieldType::kInteger;
  // Of integers: the least, the greatest, and the bits that one takes in the file. 0 bits: all are
  // the least.
  int64_t minimum = 0;
  int64_t maximum = 0;
  int bits = 0;
  // Of scaled integers: the value is the integer times `scale` plus `offset`.
  double scale = 1;
  double offset = 0;
};

// The grid of a structured set-up, as its indexBounds say; all inclusive.
struct IndexBounds {
  int64_t row_min = 0;
  int64_t row_max = 0;
  int64_t column_min = 0;
  int64_t column_max = 0;
};

// What values of a kind may be, inclusive.
struct ValueLimits {
  double min = 0;
  double max = 1;
};

// One set-up: what an instrument scanned from one place.
struct ScanSetup {
  std::string name;  // may be empty
  // From the frame of its points to that of the file (m); absent: none is stated.
  std::optional<Eigen::Isometry3d> T_file_setup;
  std::optional<IndexBounds> bounds;
  // Of intensity and of each colour, in the units of their fields, as intensityLimits and
  // colorLimits say; absent: none are stated, or nonsense.
  std::optional<ValueLimits> intensity_limits;
  std::optional<ValueLimits> colour_limits;
  std::vector<Field> fields;  // of a record, in the order in which they are stored
  uint64_t records = 0;
  uint64_t section_begin = 0;  // logical position of its records' section; meaningless without any

  // Place among the fields; absent: it has none of that name.
  std::optional<size_t> FieldOf(absl::string_view field) const;
};

// The set-ups of a file, in its order. INVALID_ARGUMENT, naming the set-up and the element: the
// description is no XML, or not what the standard says; UNIMPLEMENTED: records in another codec
// than the standard's only one.
absl::StatusOr<std::vector<ScanSetup>> ReadIndex(PagedBytes& file);

}  // namespace vantage::e57

#endif  // VANTAGE_CORE_E57_INDEX_H_
