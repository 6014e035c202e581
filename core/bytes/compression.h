// Zstandard with bounds: compressed data do not decide how much memory they take.
#ifndef VANTAGE_CORE_BYTES_COMPRESSION_H_
#define VANTAGE_CORE_BYTES_COMPRESSION_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

// One Zstandard frame. `level` in [1, 19].
std::string ZstdCompress(absl::string_view bytes, int level = 3);

// The contents of one Zstandard frame that must be exactly `size` bytes; never allocates more.
// INVALID_ARGUMENT: not one whole frame, or of another size.
absl::StatusOr<std::string> ZstdDecompress(absl::string_view frame, size_t size);

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_COMPRESSION_H_
