#include "core/bytes/lzf.h"

#include <lzf.h>

#include <cerrno>
#include <limits>

#include "absl/strings/str_cat.h"

namespace vantage::bytes {
namespace {

// The type that liblzf counts in holds no more.
constexpr size_t kMaxBytes = std::numeric_limits<unsigned int>::max();

}  // namespace

absl::StatusOr<std::string> DecompressLzf(absl::string_view block, size_t size) {
  // Three bytes unpack to at most 264.
  if (size / 88 > block.size() || block.size() > kMaxBytes || size > kMaxBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("LZF data of ", block.size(), " bytes cannot unpack to ", size, " bytes"));
  }
  std::string out(size, '\0');
  size_t unpacked = 0;
  // liblzf reads the first byte of a block without checking that there is one.
  if (!block.empty()) {
    unpacked = lzf_decompress(block.data(), static_cast<unsigned int>(block.size()), out.data(),
                              static_cast<unsigned int>(size));
    if (unpacked == 0) {
      return absl::InvalidArgumentError(
          errno == E2BIG
              ? absl::StrCat("damaged LZF data: more than the ", size, " bytes announced")
              : "damaged LZF data: cut off, or a reference to before the beginning");
    }
  }
  if (unpacked != size) {
    return absl::InvalidArgumentError(
        absl::StrCat("LZF data unpack to ", unpacked, " bytes where ", size, " were announced"));
  }
  return out;
}

}  // namespace vantage::bytes
