// Reading structured PTX.
#ifndef VANTAGE_CORE_SENSOR_PTX_H_
#define VANTAGE_CORE_SENSOR_PTX_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/bytes/byte_source.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// One scan, columns x rows, points in the scanner's frame, "0 0 0" for no return; 3 (x y z),
// 4 (+ intensity), 6 or 7 (+ r g b) numbers a line. The 4 x 4 in the header is in row-vector
// convention: its last row is the translation. It becomes T_world_scan.
//
// Reads one set-up, line by line. INVALID_ARGUMENT: not the format it claims, truncated, NaN, empty
// grid, or counts beyond the limits; the message names the line or field and what to do about it.
// UNIMPLEMENTED: a variant of the format that is not read, by name.
absl::StatusOr<ImportedScan> ParsePtx(const bytes::ByteSource& file, const ImportLimits& limits);

// Where the set-ups of a file begin, which lie one after the other, and where the last one ends. A
// file of which not even the header can be read has one; ParsePtx() says what is wrong with it.
// DATA_LOSS: the file cannot be read on; so of ParsePtx().
absl::StatusOr<std::vector<uint64_t>> FindPtxSetups(const bytes::ByteSource& file);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_PTX_H_
