#include <cstddef>
#include <cstdint>
#include <string>

#include "core/sensor/e57.h"
#include "tests/fuzz/imported_scan.h"
#include "tests/support/e57_writer.h"

// The bytes are those between the checksums, which no fuzzer would guess.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::sensor::ImportLimits limits;
  limits.max_points = vantage::fuzz::kFuzzedPoints;
  vantage::fuzz::CheckImportedScan(vantage::sensor::ParseE57(
      vantage::test_support::PagesOf({reinterpret_cast<const char*>(data), size}), 0, limits));
  return 0;
}
