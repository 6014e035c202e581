#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/bytes/compression.h"

// The first two bytes announce the size; what comes out has it, and nothing allocates more.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 2) return 0;
  const size_t announced = data[0] | static_cast<size_t>(data[1]) << 8;
  const absl::string_view frame(reinterpret_cast<const char*>(data) + 2, size - 2);
  const auto bytes = vantage::bytes::ZstdDecompress(frame, announced);
  if (bytes.ok() && bytes->size() != announced) std::abort();
  const auto back =
      vantage::bytes::ZstdDecompress(vantage::bytes::ZstdCompress(frame), frame.size());
  if (!back.ok() || *back != frame) std::abort();
  return 0;
}
