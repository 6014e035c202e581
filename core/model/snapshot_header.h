// What a snapshot's beginning says: which release's it is.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_HEADER_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_HEADER_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage {

// The format that is written, and the newest that is read.
inline constexpr uint16_t kSnapshotFormatVersion = 3;
// Rises when the same scans would give another model. A snapshot of an older version is loaded as
// it is rather than replayed differently, and saved again as of that version for as long as a scan
// that it carved is in the model.
inline constexpr uint32_t kModelAlgorithmVersion = 4;

// What a snapshot's beginning says.
struct SnapshotHeader {
  uint16_t format_version = 0;
  uint32_t algorithm_version = 0;
};

// DATA_LOSS: damaged, or no snapshot. FAILED_PRECONDITION: of a newer format or newer algorithms.
absl::StatusOr<SnapshotHeader> ReadSnapshotHeader(absl::string_view bytes);

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_HEADER_H_
