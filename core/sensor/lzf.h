// Decompression of LZF blocks, as PCD's binary_compressed holds them.
#ifndef VANTAGE_CORE_SENSOR_LZF_H_
#define VANTAGE_CORE_SENSOR_LZF_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage {

// A block is a sequence of runs. A control byte c below 32 is followed by c + 1 bytes to copy as
// they are. Otherwise the upper three bits are a length (7: add the next byte), the lower five are
// the upper bits of a distance whose lower eight are the next byte: copy length + 2 bytes that were
// written distance + 1 bytes ago.
//
// INVALID_ARGUMENT when the block is damaged or does not unpack to exactly `size` bytes. Reserves
// no more than a block of this length can unpack to.
absl::StatusOr<std::string> DecompressLzf(absl::string_view block, size_t size);

}  // namespace vantage

#endif  // VANTAGE_CORE_SENSOR_LZF_H_
