#include "server/session/stored_snapshots.h"

#include <algorithm>
#include <utility>

namespace vantage::session {

StoredSnapshots::StoredSnapshots(SessionContext& context, std::vector<store::SnapshotRecord> listed)
    : context_(context), snapshots_(std::move(listed)) {
  for (const store::SnapshotRecord& snapshot : snapshots_) {
    context_.account()->Add(context_.dependencies().store.BlobSize(snapshot.blob).value_or(0));
  }
}

std::vector<store::SnapshotRecord> StoredSnapshots::List() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return snapshots_;
}

absl::Status StoredSnapshots::Add(const std::string& bytes, store::SnapshotRecord record) {
  store::Store& store = context_.dependencies().store;
  const absl::StatusOr<std::string> blob = context_.PutOwnBlob(bytes);
  if (!blob.ok()) return blob.status();
  record.blob = *blob;
  absl::Status written;
  std::vector<std::string> unused;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    // A closed session has released its blobs.
    written = context_.closed() ? absl::CancelledError("the session was deleted")
                                : store.PutSnapshot(context_.id(), record);
    if (written.ok()) {
      std::erase_if(snapshots_, [&](const store::SnapshotRecord& known) {
        if (known.sequence == record.sequence) unused.push_back(known.blob);
        return known.sequence == record.sequence;
      });
      snapshots_.insert(snapshots_.begin(), record);
      while (snapshots_.size() > context_.dependencies().limits.snapshots_per_session) {
        const store::SnapshotRecord oldest = snapshots_.back();
        if (!store.DropSnapshot(context_.id(), oldest.sequence).ok()) break;
        unused.push_back(oldest.blob);
        snapshots_.pop_back();
      }
    } else {
      unused.push_back(*blob);
    }
  }
  for (const std::string& released : unused) context_.ReleaseOwnBlob(released);
  return written;
}

void StoredSnapshots::Drop(const store::SnapshotRecord& record) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto is_it = [&](const store::SnapshotRecord& it) { return it.blob == record.blob; };
  // It may have been dropped since it was listed.
  if (std::none_of(snapshots_.begin(), snapshots_.end(), is_it)) return;
  DropWhere([&](const store::SnapshotRecord& it) { return it.sequence == record.sequence; });
}

void StoredSnapshots::DropBefore(uint64_t sequence) {
  std::lock_guard<std::mutex> lock(mutex_);
  DropWhere([sequence](const store::SnapshotRecord& it) { return it.sequence < sequence; });
}

// The record goes first: a blob that a crash leaves behind has no holder, and is collected at the
// next start.
void StoredSnapshots::DropWhere(
    absl::FunctionRef<bool(const store::SnapshotRecord& snapshot)> goes) {
  if (context_.closed()) return;
  std::erase_if(snapshots_, [&](const store::SnapshotRecord& it) {
    if (!goes(it)) return false;
    if (!context_.dependencies().store.DropSnapshot(context_.id(), it.sequence).ok()) return false;
    context_.ReleaseOwnBlob(it.blob);
    return true;
  });
}

std::vector<std::string> StoredSnapshots::TakeBlobs() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> blobs;
  for (const store::SnapshotRecord& snapshot : snapshots_) blobs.push_back(snapshot.blob);
  snapshots_.clear();
  return blobs;
}

}  // namespace vantage::session
