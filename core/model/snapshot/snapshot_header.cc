#include "core/model/snapshot/snapshot_header.h"

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"
#include "core/model/view/algorithm_version.h"

namespace vantage::model {

absl::Status SnapshotDamaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("snapshot: ", what));
}

absl::Status SnapshotOfNewerAlgorithms(uint64_t version) {
  return absl::FailedPreconditionError(
      absl::StrCat("snapshot: newer algorithms made the model (version ", version,
                   "; here they are of version ", kModelAlgorithmVersion, ")"));
}

absl::StatusOr<SnapshotHeader> ReadSnapshotHeader(absl::string_view bytes) {
  if (bytes.size() < kSnapshotHeadSize || bytes.substr(0, kSnapshotMagicSize) != kSnapshotMagic) {
    return SnapshotDamaged("it does not begin as one");
  }
  SnapshotHeader header;
  header.format_version = bytes::LoadLittleEndian<uint16_t>(bytes.data() + 4);
  header.algorithm_version = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 8);
  if (header.format_version > kSnapshotFormatVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("snapshot: a newer release wrote it (format ", header.format_version,
                     "; this one reads up to ", kSnapshotFormatVersion, ")"));
  }
  const auto count = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 12);
  const size_t rest = bytes.size() - kSnapshotHeadSize;
  if (rest < kSnapshotChecksumSize || count > (rest - kSnapshotChecksumSize) / kSnapshotEntrySize) {
    return SnapshotDamaged("it is cut short");
  }
  const size_t summed = kSnapshotHeadSize + count * kSnapshotEntrySize;
  if (bytes::LoadLittleEndian<uint32_t>(bytes.data() + summed) !=
          bytes::Crc32c(bytes.substr(0, summed)) ||
      header.format_version == 0) {
    return SnapshotDamaged("its header is damaged");
  }
  if (header.algorithm_version > kModelAlgorithmVersion) {
    return SnapshotOfNewerAlgorithms(header.algorithm_version);
  }
  return header;
}

}  // namespace vantage::model
