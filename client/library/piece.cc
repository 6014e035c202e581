#include "client/library/piece.h"

#include <string>
#include <utility>

#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"

namespace vantage::client {
v1::Piece MakePiece(absl::string_view bytes, int64_t sequence, int64_t offset) {
  v1::Piece piece;
  piece.set_sequence(sequence);
  piece.set_offset(offset);
  piece.set_uncompressed_size_bytes(static_cast<int64_t>(bytes.size()));
  piece.set_crc32c(bytes::Crc32c(bytes));
  std::string compressed = bytes::ZstdCompress(bytes);
  if (compressed.size() < bytes.size()) {
    *piece.mutable_data() = std::move(compressed);
    piece.set_compression(v1::COMPRESSION_ZSTD);
  } else {
    piece.set_data(bytes.data(), bytes.size());
    piece.set_compression(v1::COMPRESSION_NONE);
  }
  return piece;
}

}  // namespace vantage::client
