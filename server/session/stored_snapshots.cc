#include "server/session/stored_snapshots.h"

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
  if (context_.closed() ||
      !context_.dependencies().store.DropSnapshot(context_.id(), record.sequence).ok()) {
    return;
  }
  std::erase_if(snapshots_,
                [&](const store::SnapshotRecord& it) { return it.sequence == record.sequence; });
  context_.ReleaseOwnBlob(record.blob);
}

std::vector<std::string> StoredSnapshots::TakeBlobs() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> blobs;
  for (const store::SnapshotRecord& snapshot : snapshots_) blobs.push_back(snapshot.blob);
  snapshots_.clear();
  return blobs;
}

}  // namespace vantage::session
