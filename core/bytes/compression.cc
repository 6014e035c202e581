#include "core/bytes/compression.h"

#include <zstd.h>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace vantage::bytes {

std::string ZstdCompress(absl::string_view bytes, int level) {
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), level);
  // Cannot fail: the output is large enough by construction.
  frame.resize(ZSTD_isError(size) != 0 ? 0 : size);
  return frame;
}

absl::StatusOr<std::string> ZstdDecompress(absl::string_view frame, size_t size) {
  const size_t frame_size = ZSTD_findFrameCompressedSize(frame.data(), frame.size());
  if (ZSTD_isError(frame_size) != 0 || frame_size != frame.size()) {
    return absl::InvalidArgumentError("not one whole Zstandard frame");
  }
  std::string bytes(size, '\0');
  const size_t written = ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size());
  if (ZSTD_isError(written) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("Zstandard frame does not decompress: ", ZSTD_getErrorName(written)));
  }
  if (written != size) {
    return absl::InvalidArgumentError(
        absl::StrCat("Zstandard frame holds ", written, " bytes, not the ", size, " stated"));
  }
  return bytes;
}

}  // namespace vantage::bytes
