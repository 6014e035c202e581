#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/sensor/encoding.h"

// Every accepted image is valid and is the only one with these bytes.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const absl::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto image = vantage::sensor::DecodeRangeImage(
      bytes, 1 << 16, vantage::sensor::RangeImageDecoder::Keep::kAll);
  if (!image.ok()) return 0;
  if (!image->Validate().ok()) std::abort();
  if (vantage::sensor::EncodeRangeImage(*image) != bytes) std::abort();
  return 0;
}
