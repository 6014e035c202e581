// The beginning of a snapshot, which tells the release that wrote it.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_HEADER_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_HEADER_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::model {

// The format that is written, and the newest that is read.
inline constexpr uint16_t kSnapshotFormatVersion = 3;

// What the beginning says.
struct SnapshotHeader {
  uint16_t format_version = 0;
  uint32_t algorithm_version = 0;
};

// DATA_LOSS: damaged, or no snapshot. FAILED_PRECONDITION: of a newer format or newer algorithms.
absl::StatusOr<SnapshotHeader> ReadSnapshotHeader(absl::string_view bytes);

// How a snapshot begins: magic, format version, 2 bytes of zero, algorithm version, count of
// sections; an entry for each; a checksum of it all. In bytes.
inline constexpr char kSnapshotMagic[] = "VSNP";
inline constexpr size_t kSnapshotMagicSize = 4;
inline constexpr size_t kSnapshotHeadSize = 16;
inline constexpr size_t kSnapshotEntrySize = 24;
inline constexpr size_t kSnapshotChecksumSize = 4;

// The errors of a snapshot that cannot be read.
absl::Status SnapshotDamaged(absl::string_view what);
absl::Status SnapshotOfNewerAlgorithms(uint64_t version);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_HEADER_H_
