// The store of sessions: one append-only log per session, blobs by their SHA-256, and a spool per
// upload. What a method returned OK for is kept for as long as the store promises.
#ifndef VANTAGE_SERVER_STORE_STORE_H_
#define VANTAGE_SERVER_STORE_STORE_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/store/durable_file.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::store {

// The format in which entries are written, and the newest that is read. Entries of format 1, of
// release 0.1, are translated to this one (upgrade.h).
inline constexpr uint32_t kLogFormatVersion = 2;

// A snapshot of a session's model, with which a restart begins. It is never needed: its contents
// follow from the log and the scans.
struct SnapshotRecord {
  uint64_t sequence = 0;           // of the session's last entry when it was taken
  uint32_t algorithm_version = 0;  // of the algorithms that made the model
  std::string blob;                // SHA-256, 32 bytes
};

// The request that deleted a session.
struct DeletionRecord {
  std::string tenant;
  std::string request;  // its id
  std::string session;
  absl::Time time;  // by the wall clock
};

// Thread safe. Errors of every method: RESOURCE_EXHAUSTED when there is no room (nothing was
// changed), UNAVAILABLE when the medium fails, DATA_LOSS when what was kept is damaged.
class Store {
 public:
  virtual ~Store() = default;

  // Appends an entry to the log of a session; a log begins with sequence number 1. ABORTED when
  // the entry's sequence number is not the next (somebody else writes this session).
  virtual absl::Status Append(const std::string& session, const storage::v1::LogEntry& entry) = 0;
  // Entries with sequence numbers above `after`, in order, at most `limit`; the first may stand for
  // earlier ones, too, that were left out. NOT_FOUND.
  virtual absl::StatusOr<std::vector<storage::v1::LogEntry>> Read(const std::string& session,
                                                                  uint64_t after,
                                                                  size_t limit) const = 0;
  // Puts entries of the kind events_left_out, in order, in place of those that they stand for: all
  // or none. ABORTED when one does not stand for whole entries that the log has, or for its last.
  virtual absl::Status Compact(const std::string& session,
                               const std::vector<storage::v1::LogEntry>& entries) = 0;
  // Every session that has a log, sorted.
  virtual absl::StatusOr<std::vector<std::string>> Sessions() const = 0;
  // Makes the log of a session that has none of the entries (serialised
  // vantage.storage.v1.LogEntry) that a spool has, in order: all or none, durably. ABORTED: it has
  // a log, or entries are missing.
  virtual absl::Status PutLog(const std::string& session, const std::string& spool) = 0;
  // Forgets a session's log. NOT_FOUND. Blobs that nobody else holds go with ReleaseBlob.
  virtual absl::Status Drop(const std::string& session) = 0;
  // The same, and remembers in the same step the request that asked for it.
  virtual absl::Status DropByRequest(const DeletionRecord& deletion) = 0;
  // The last deletions that were asked for, oldest first; so many are remembered.
  static constexpr int kRememberedDeletions = 4096;
  virtual absl::StatusOr<std::vector<DeletionRecord>> Deletions() const = 0;

  // Remembers a snapshot of a session that has a log (else NOT_FOUND), in place of one of the same
  // sequence number. Dropped with the session; its blob's holder is the caller.
  virtual absl::Status PutSnapshot(const std::string& session, const SnapshotRecord& snapshot) = 0;
  // Newest first; none for a session without any.
  virtual absl::StatusOr<std::vector<SnapshotRecord>> Snapshots(
      const std::string& session) const = 0;
  // Has no effect when there is none.
  virtual absl::Status DropSnapshot(const std::string& session, uint64_t sequence) = 0;

  // Notes that work on something of a session (its name) begins, durably; returns how often that
  // was noted since it last ended, this time included: more than once when the process that did the
  // work came to its end first. NOT_FOUND: the session has no log. Dropped with the session.
  virtual absl::StatusOr<int> BeginWork(const std::string& session, const std::string& work) = 0;
  // Forgets what BeginWork() noted. Has no effect when there is nothing.
  virtual absl::Status EndWork(const std::string& session, const std::string& work) = 0;

  // Keeps bytes under their SHA-256 (32 bytes), which is returned. Counted: each Put takes one
  // ReleaseBlob.
  virtual absl::StatusOr<std::string> PutBlob(absl::string_view bytes) = 0;
  // Keeps the bytes that the pieces of a synced spool make, under their SHA-256, which is known.
  // The spool stays until it is dropped, and gets no more records. Counted as PutBlob().
  virtual absl::Status PutSpool(const std::string& spool, const std::string& sha256) = 0;
  // The bytes that a blob takes in the store; a scan is kept compressed as it arrived. NOT_FOUND.
  virtual absl::StatusOr<int64_t> BlobSize(const std::string& sha256) const = 0;
  // NOT_FOUND.
  virtual absl::StatusOr<std::string> GetBlob(const std::string& sha256) const = 0;
  virtual absl::Status ReleaseBlob(const std::string& sha256) = 0;
  // Sets how many holders each blob has, by the logs after a restart; all other blobs are removed.
  virtual absl::Status KeepBlobs(const std::map<std::string, int>& holders) = 0;
  // The same where not every log can be read: each blob that is there has a holder that is not
  // known, who never lets go, so that it stays.
  virtual absl::Status KeepAllBlobs(const std::map<std::string, int>& holders) = 0;

  // Appends a record (a serialised vantage.storage.v1.SpoolRecord) to what an upload brought so
  // far; it is kept for sure after SyncSpool. `spool` is unique for ever; one record of a spool at
  // a time.
  virtual absl::Status AppendSpool(const std::string& spool, absl::string_view record) = 0;
  // Syncs everything that was appended before. On an error it is not known how much was kept: call
  // CutSpool() with what was kept for certain.
  virtual absl::Status SyncSpool(const std::string& spool) = 0;
  // Forgets all but the first `records`.
  virtual absl::Status CutSpool(const std::string& spool, size_t records) = 0;
  // Calls visit(record) for every record, in order, until it returns an error, which is returned. A
  // spool that was never written has no records. Ends before a damaged record, which its sender
  // still has.
  virtual absl::Status ReadSpool(
      const std::string& spool, absl::FunctionRef<absl::Status(absl::string_view)> visit) const = 0;
  // The bytes that the pieces of a spool make, as a file of its own, open for reading: no name
  // leads to it, and it is gone when it is closed. It takes as much room again. DATA_LOSS: a piece
  // is damaged; NOT_FOUND: nothing of the spool is there.
  virtual absl::StatusOr<FileDescriptor> OpenSpool(const std::string& spool) const = 0;
  virtual absl::Status DropSpool(const std::string& spool) = 0;
  // Every spool that was written and not dropped, sorted.
  virtual absl::StatusOr<std::vector<std::string>> Spools() const = 0;

  // Bytes that it could still take; as many as the medium says, which others may use, too.
  virtual absl::StatusOr<int64_t> FreeBytes() const = 0;

  // The time that servers of this store have seen pass (execution/seen_time.h), as last put; 0
  // where none was.
  virtual absl::StatusOr<absl::Duration> SeenTime() const = 0;
  virtual absl::Status PutSeenTime(absl::Duration seen) = 0;
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_STORE_H_
