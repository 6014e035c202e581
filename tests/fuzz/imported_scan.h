// What must hold of every scan that an importer accepts, whatever the bytes were.
#ifndef VANTAGE_TESTS_FUZZ_IMPORTED_SCAN_H_
#define VANTAGE_TESTS_FUZZ_IMPORTED_SCAN_H_

#include <cstdio>
#include <cstdlib>
#include <string>

#include "absl/status/statusor.h"
#include "core/sensor/encoding.h"
#include "core/sensor/imported_scan.h"

namespace vantage::fuzz {

inline constexpr size_t kFuzzedPoints = 20'000;

inline void Require(bool condition, const std::string& what) {
  if (condition) return;
  std::fprintf(stderr, "violated: %s\n", what.c_str());
  std::abort();
}

inline void CheckImportedScan(const absl::StatusOr<sensor::ImportedScan>& scan) {
  if (!scan.ok()) {
    Require(absl::IsInvalidArgument(scan.status()) || absl::IsUnimplemented(scan.status()),
            "refused as INVALID_ARGUMENT or UNIMPLEMENTED: " + scan.status().ToString());
    Require(!scan.status().message().empty(), "a refusal says why");
    return;
  }
  Require(scan->image.Validate().ok(), "image: " + scan->image.Validate().ToString());
  Require(scan->points <= kFuzzedPoints, "the limit on points");
  const std::string bytes = sensor::EncodeRangeImage(scan->image);
  const absl::StatusOr<sensor::RangeImage> back =
      sensor::DecodeRangeImage(bytes, scan->image.cells());
  // Returns beyond what the encoding holds may leave nothing to decode.
  if (back.ok()) Require(sensor::EncodeRangeImage(*back) == bytes, "one encoding for each image");
}

}  // namespace vantage::fuzz

#endif  // VANTAGE_TESTS_FUZZ_IMPORTED_SCAN_H_
