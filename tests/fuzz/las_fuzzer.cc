#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "core/sensor/las.h"
#include "tests/fuzz/imported_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::sensor::ImportLimits limits;
  limits.max_points = vantage::fuzz::kFuzzedPoints;
  vantage::sensor::PointCloud cloud({0, 0, 0}, limits.unit);
  const absl::Status read = vantage::sensor::ReadLas(
      absl::string_view(reinterpret_cast<const char*>(data), size), limits, cloud);
  vantage::fuzz::CheckImportedScan(read.ok() ? cloud.ToScan(limits) : read);
  return 0;
}
