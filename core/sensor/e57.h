// Scans from E57 files (ASTM E2807).
#ifndef VANTAGE_CORE_SENSOR_E57_H_
#define VANTAGE_CORE_SENSOR_E57_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/bytes/byte_source.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// The set-ups of a file, in its order, by the names that it gives them ("" for one without). Errors
// as of ParseE57().
absl::StatusOr<std::vector<std::string>> ListE57Setups(const bytes::ByteSource& file);

// One set-up of a file, counted from 0. Its pose becomes T_world_scan.
//
// Structured set-ups (rowIndex, columnIndex) are grids (gridded_scan.h, rule 1), as large as
// indexBounds and the indices of the records say together; a cell without a record, one whose
// record is invalid (cartesianInvalidState or sphericalInvalidState 1 or 2, whatever type the file
// stores it as), at 0 0 0 or not finite has no return. Of several returns of a ray the first
// counts. Set-ups without indices are sorted into a grid by the directions of their points (rules 2
// and 4). Cartesian coordinates are taken where there are both kinds. Points are in the set-up's
// frame, as the standard says.
//
// Reads the file piece by piece. INVALID_ARGUMENT: not the format it claims, cut off, no such
// set-up, no points, or counts beyond the limits; DATA_LOSS: a checksum is wrong; UNIMPLEMENTED: a
// variant that is not read. The message names set-up, element or record, and what to do about it.
absl::StatusOr<ImportedScan> ParseE57(const bytes::ByteSource& file, size_t setup,
                                      const ImportLimits& limits);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_E57_H_
