// Cutting an encoded range image into pieces for the wire.
#ifndef VANTAGE_CLIENT_LIBRARY_PIECE_H_
#define VANTAGE_CLIENT_LIBRARY_PIECE_H_

#include <cstdint>

#include "absl/strings/string_view.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::client {

// The piece that holds `bytes` (not empty) at this place: compressed where that shortens them, with
// the checksum of the uncompressed bytes.
v1::Piece MakePiece(absl::string_view bytes, int64_t sequence, int64_t offset);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_PIECE_H_
