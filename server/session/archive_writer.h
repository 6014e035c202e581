// A session as one file (storage/v1/archive.proto), part by part, so that memory holds one scan.
#ifndef VANTAGE_SERVER_SESSION_ARCHIVE_WRITER_H_
#define VANTAGE_SERVER_SESSION_ARCHIVE_WRITER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/bytes/checksum.h"
#include "server/session/session.h"
#include "vantage/storage/v1/archive.pb.h"

namespace vantage::session {

// Not thread safe.
class ArchiveWriter {
 public:
  // Of the session as it is now; `session` outlives it.
  explicit ArchiveWriter(Session& session);

  // The next part; empty at the end. DATA_LOSS (SCAN_LOST): the data of a scan that is in the model
  // or waits to be are lost. UNAVAILABLE (SESSION_CHANGED): entries were left out of the log, or
  // a scan's data erased, since it began; begin anew.
  absl::StatusOr<std::string> Next();

 private:
  struct Blob {
    std::string sha256;
    storage::v1::ArchiveBlobKind kind;
    std::string owner;         // by name
    bool may_be_lost = false;  // of a scan that was withdrawn: nothing needs it
  };
  std::string Written(const storage::v1::ArchiveRecord& record);
  absl::StatusOr<std::string> NextBlob();
  absl::StatusOr<std::string> NextEntries();

  Session& session_;
  storage::v1::ArchiveRecord header_;
  std::vector<Blob> blobs_;
  uint64_t last_sequence_ = 0;
  bool began_ = false;
  size_t next_blob_ = 0;
  uint64_t after_ = 0;  // the last entry that was written
  bool ended_ = false;
  bytes::Sha256 sha256_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_ARCHIVE_WRITER_H_
