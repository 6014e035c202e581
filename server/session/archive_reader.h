// The records of an archive (storage/v1/archive.proto) as its bytes come in.
#ifndef VANTAGE_SERVER_SESSION_ARCHIVE_READER_H_
#define VANTAGE_SERVER_SESSION_ARCHIVE_READER_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/bytes/checksum.h"
#include "vantage/storage/v1/archive.pb.h"

namespace vantage::session {

inline constexpr uint32_t kArchiveFormatVersion = 1;
// Of a record, bytes. The largest are entries of plans, whose basic view has 200 views of about
// 1 KiB.
inline constexpr size_t kMaxArchiveRecord = size_t{8} << 20;
// Of a chunk before compression, bytes.
inline constexpr size_t kArchiveChunk = size_t{1} << 20;

// DATA_LOSS (ARCHIVE_DAMAGED).
absl::Status ArchiveDamaged(absl::string_view what);

// Not thread safe. Holds one record and what was added last.
class ArchiveReader {
 public:
  void Add(absl::string_view bytes);
  // The next record, once all of it has come; nullopt: more is needed. DATA_LOSS
  // (ARCHIVE_DAMAGED): it is none, or the archive's checksum at its end is another one's.
  absl::StatusOr<std::optional<storage::v1::ArchiveRecord>> Next();
  // True when the end was read and nothing follows it.
  bool whole() const { return ended_ && at_ == buffer_.size(); }

 private:
  std::string buffer_;
  size_t at_ = 0;         // of it was read
  bytes::Sha256 sha256_;  // of all records before the one that comes next
  bool ended_ = false;
};

// A record as it stands in an archive.
std::string WriteArchiveRecord(const storage::v1::ArchiveRecord& record);

// The bytes of a chunk. DATA_LOSS (ARCHIVE_DAMAGED).
absl::StatusOr<std::string> ReadArchiveChunk(const storage::v1::ArchiveChunk& chunk);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_ARCHIVE_READER_H_
