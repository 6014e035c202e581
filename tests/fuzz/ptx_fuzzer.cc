#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "core/sensor/ptx.h"
#include "tests/fuzz/imported_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::sensor::ImportLimits limits;
  limits.max_points = vantage::fuzz::kFuzzedPoints;
  vantage::fuzz::CheckImportedScan(vantage::sensor::ParsePtx(
      absl::string_view(reinterpret_cast<const char*>(data), size), limits));
  return 0;
}
