// Records of an upload as they are kept: its pieces stay compressed as they arrived.
#ifndef VANTAGE_SERVER_STORE_PIECE_RECORD_H_
#define VANTAGE_SERVER_STORE_PIECE_RECORD_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::store {

// DATA_LOSS: not a record.
absl::StatusOr<storage::v1::SpoolRecord> ParseSpoolRecord(absl::string_view record);

// A piece's bytes before compression. DATA_LOSS.
absl::StatusOr<std::string> PieceBytes(storage::v1::SpoolRecord::Piece piece);

// Appends a record's part of the encoded range image, which may be empty. DATA_LOSS.
absl::Status AppendPiece(absl::string_view record, std::string& whole);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_PIECE_RECORD_H_
