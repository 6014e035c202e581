// Where sessions are kept: one append-only log per session, blobs by their SHA-256, and a spool per
// upload. The interface is what a durable store needs: everything that returned OK is kept.
#ifndef VANTAGE_SERVER_STORE_STORE_H_
#define VANTAGE_SERVER_STORE_STORE_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "vantage/store/v1/log.pb.h"

namespace vantage {

// Format that entries are written in, and the newest that is read.
inline constexpr uint32_t kLogFormatVersion = 1;

// Thread safe. Errors of every method: RESOURCE_EXHAUSTED when there is no room (nothing was
// changed), UNAVAILABLE when the medium fails.
class Store {
 public:
  virtual ~Store() = default;

  // Appends an entry to the log of a session; a log begins with sequence number 1. ABORTED when
  // the entry's sequence number is not the next (somebody else writes this session).
  virtual absl::Status Append(const std::string& session, const store::v1::LogEntry& entry) = 0;
  // Entries with sequence numbers above `after`, in order, at most `limit`. NOT_FOUND.
  virtual absl::StatusOr<std::vector<store::v1::LogEntry>> Read(const std::string& session,
                                                                uint64_t after,
                                                                size_t limit) const = 0;
  // Every session that has a log, sorted.
  virtual absl::StatusOr<std::vector<std::string>> Sessions() const = 0;
  // Forgets a session's log. Blobs that nobody else holds go with ReleaseBlob.
  virtual absl::Status Drop(const std::string& session) = 0;

  // Keeps bytes under their SHA-256 (32 bytes), which is returned. Counted: each Put takes one
  // ReleaseBlob.
  virtual absl::StatusOr<std::string> PutBlob(absl::string_view bytes) = 0;
  virtual absl::StatusOr<std::string> GetBlob(const std::string& sha256) const = 0;
  virtual absl::Status ReleaseBlob(const std::string& sha256) = 0;

  // The bytes of an upload on their way. `spool` is unique for ever.
  virtual absl::Status AppendSpool(const std::string& spool, absl::string_view bytes) = 0;
  // Everything appended so far; empty for a spool that was never written.
  virtual absl::StatusOr<std::string> ReadSpool(const std::string& spool) const = 0;
  virtual absl::Status DropSpool(const std::string& spool) = 0;
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_STORE_STORE_H_
