#include "server/store/piece_record.h"

#include <cstddef>
#include <utility>

#include "core/bytes/compression.h"

namespace vantage::store {

absl::StatusOr<storage::v1::SpoolRecord> ParseSpoolRecord(absl::string_view record) {
  storage::v1::SpoolRecord parsed;
  if (!parsed.ParseFromArray(record.data(), static_cast<int>(record.size())) ||
      parsed.kind_case() == storage::v1::SpoolRecord::KIND_NOT_SET) {
    return absl::DataLossError("a record of an upload is not what was written");
  }
  return parsed;
}

absl::StatusOr<std::string> PieceBytes(storage::v1::SpoolRecord::Piece piece) {
  if (piece.compression() != v1::COMPRESSION_ZSTD) return std::move(*piece.mutable_data());
  absl::StatusOr<std::string> bytes =
      bytes::ZstdDecompress(piece.data(), static_cast<size_t>(piece.uncompressed_size_bytes()));
  if (!bytes.ok()) return absl::DataLossError(bytes.status().message());
  return bytes;
}

absl::Status AppendPiece(absl::string_view record, std::string& whole) {
  absl::StatusOr<storage::v1::SpoolRecord> parsed = ParseSpoolRecord(record);
  if (!parsed.ok()) return parsed.status();
  if (!parsed->has_piece()) return absl::OkStatus();
  const absl::StatusOr<std::string> bytes = PieceBytes(std::move(*parsed->mutable_piece()));
  if (!bytes.ok()) return bytes.status();
  whole += *bytes;
  return absl::OkStatus();
}

}  // namespace vantage::store
