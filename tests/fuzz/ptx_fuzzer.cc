#include <cstddef>
#include <cstdint>

#include "tests/fuzz/imported_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::ImportLimits limits;
  limits.max_points = vantage::kFuzzedPoints;
  vantage::CheckImportedScan(
      vantage::ParsePtx({reinterpret_cast<const char*>(data), size}, limits));
  return 0;
}
