#include <cstddef>
#include <cstdint>

#include "core/sensor/pcd.h"
#include "tests/fuzz/imported_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::sensor::ImportLimits limits;
  limits.max_points = vantage::fuzz::kFuzzedPoints;
  vantage::fuzz::CheckImportedScan(
      vantage::sensor::ParsePcd({reinterpret_cast<const char*>(data), size}, limits));
  return 0;
}
