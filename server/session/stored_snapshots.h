// The snapshots of a session's model that the store has: each a blob, listed beside the log.
#ifndef VANTAGE_SERVER_SESSION_STORED_SNAPSHOTS_H_
#define VANTAGE_SERVER_SESSION_STORED_SNAPSHOTS_H_

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "server/session/session_context.h"
#include "server/store/store.h"

namespace vantage::session {

// Thread safe.
class StoredSnapshots {
 public:
  // `listed`: the snapshots that the store lists, newest first. They count for the session's
  // account.
  StoredSnapshots(SessionContext& context, std::vector<store::SnapshotRecord> listed);

  // Newest first.
  std::vector<store::SnapshotRecord> List() const;
  // Stores `bytes` as the newest snapshot, replaces one of the same sequence, and keeps as many
  // older ones as Limits allows. CANCELLED: the session is closed.
  absl::Status Add(const std::string& bytes, store::SnapshotRecord record);
  // Releases a damaged snapshot, so that the next one is written.
  void Drop(const store::SnapshotRecord& record);
  // Releases those of entries before `sequence`.
  void DropBefore(uint64_t sequence);
  // The session is closed: all of them, which the caller releases.
  std::vector<std::string> TakeBlobs();

 private:
  void DropWhere(absl::FunctionRef<bool(const store::SnapshotRecord& snapshot)> goes)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  SessionContext& context_;
  mutable std::mutex mutex_;  // held while they are written to the store
  std::vector<store::SnapshotRecord> snapshots_ ABSL_GUARDED_BY(mutex_);  // newest first
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_STORED_SNAPSHOTS_H_
