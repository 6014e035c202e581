#include "server/session/archive_reader.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "google/protobuf/util/delimited_message_util.h"
#include "server/contract/error.h"

namespace vantage::session {

absl::Status ArchiveDamaged(absl::string_view what) {
  return contract::ErrorWithReason(
      absl::StatusCode::kDataLoss, "ARCHIVE_DAMAGED",
      absl::StrCat("the archive is damaged: ", what,
                   "; export it anew, or send it again under another request_id"));
}

void ArchiveReader::Add(absl::string_view bytes) {
  buffer_.erase(0, at_);
  at_ = 0;
  buffer_.append(bytes.data(), bytes.size());
}

absl::StatusOr<std::optional<storage::v1::ArchiveRecord>> ArchiveReader::Next() {
  const absl::string_view left = absl::string_view(buffer_).substr(at_);
  if (left.empty()) return std::nullopt;
  if (ended_) return ArchiveDamaged("something follows its end");
  google::protobuf::io::CodedInputStream input(
      reinterpret_cast<const uint8_t*>(left.data()),  // NOLINT: bytes
      static_cast<int>(left.size()));
  uint32_t size = 0;
  if (!input.ReadVarint32(&size)) {
    constexpr size_t kLongestVarint = 5;
    if (left.size() < kLongestVarint) return std::nullopt;
    return ArchiveDamaged("a record has no length");
  }
  if (size == 0 || size > kMaxArchiveRecord) {
    return ArchiveDamaged(absl::StrCat("a record of ", size, " bytes"));
  }
  const auto prefix = static_cast<size_t>(input.CurrentPosition());
  if (left.size() < prefix + size) return std::nullopt;
  storage::v1::ArchiveRecord record;
  if (!record.ParseFromArray(left.data() + prefix, static_cast<int>(size))) {
    return ArchiveDamaged("a record that cannot be read");
  }
  if (record.has_end()) {
    if (record.end().sha256() != sha256_.Digest()) {
      return ArchiveDamaged("its SHA-256 is not the one that it states");
    }
    ended_ = true;
  }
  sha256_.Update(left.substr(0, prefix + size));
  at_ += prefix + size;
  return record;
}

std::string WriteArchiveRecord(const storage::v1::ArchiveRecord& record) {
  std::string bytes;
  google::protobuf::io::StringOutputStream output(&bytes);
  google::protobuf::util::SerializeDelimitedToZeroCopyStream(record, &output);
  return bytes;
}

absl::StatusOr<std::string> ReadArchiveChunk(const storage::v1::ArchiveChunk& chunk) {
  const int64_t size = chunk.uncompressed_size_bytes();
  if (size < 1 || size > static_cast<int64_t>(kArchiveChunk)) {
    return ArchiveDamaged(absl::StrCat("a chunk of ", size, " bytes"));
  }
  absl::StatusOr<std::string> bytes =
      bytes::ZstdDecompress(chunk.data(), static_cast<size_t>(size));
  if (!bytes.ok() || bytes::Crc32c(*bytes) != chunk.crc32c()) {
    return ArchiveDamaged("a chunk whose checksum is not the one that it states");
  }
  return bytes;
}

}  // namespace vantage::session
