// LZF with bounds: blocks as PCD's binary_compressed holds them.
#ifndef VANTAGE_CORE_BYTES_LZF_H_
#define VANTAGE_CORE_BYTES_LZF_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

// INVALID_ARGUMENT when the block is damaged or does not unpack to exactly `size` bytes. Allocates
// no more than a block of this length can unpack to.
absl::StatusOr<std::string> DecompressLzf(absl::string_view block, size_t size);

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_LZF_H_
