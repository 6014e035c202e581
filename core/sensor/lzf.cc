#include "core/sensor/lzf.h"

#include <cstdint>

#include "absl/strings/str_cat.h"

namespace vantage {
namespace {

absl::Status Damaged(size_t offset) {
  return absl::InvalidArgumentError(
      absl::StrCat("damaged LZF data at byte ", offset, " of the block"));
}

}  // namespace

absl::StatusOr<std::string> DecompressLzf(absl::string_view block, size_t size) {
  // Three bytes unpack to at most 264.
  if (size / 88 > block.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("LZF data of ", block.size(), " bytes cannot unpack to ", size, " bytes"));
  }
  std::string out;
  out.reserve(size);
  size_t at = 0;
  const auto byte = [&] { return static_cast<uint8_t>(block[at++]); };
  while (at < block.size()) {
    const size_t run = at;
    const size_t control = byte();
    if (control < 32) {
      const size_t length = control + 1;
      if (length > block.size() - at || length > size - out.size()) return Damaged(run);
      out.append(block.data() + at, length);
      at += length;
      continue;
    }
    size_t length = control >> 5;
    if (length == 7) {
      if (at == block.size()) return Damaged(run);
      length += byte();
    }
    length += 2;
    if (at == block.size()) return Damaged(run);
    const size_t distance = ((control & 31) << 8 | byte()) + 1;
    if (distance > out.size() || length > size - out.size()) return Damaged(run);
    // Source and target may overlap: byte by byte.
    for (size_t i = 0; i < length; ++i) out.push_back(out[out.size() - distance]);
  }
  if (out.size() != size) {
    return absl::InvalidArgumentError(
        absl::StrCat("LZF data unpack to ", out.size(), " bytes where ", size, " were announced"));
  }
  return out;
}

}  // namespace vantage
