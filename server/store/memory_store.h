// A store that lives as long as the process.
#ifndef VANTAGE_SERVER_STORE_MEMORY_STORE_H_
#define VANTAGE_SERVER_STORE_MEMORY_STORE_H_

#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/store/store.h"

namespace vantage::store {

class MemoryStore : public Store {
 public:
  // Holds at most `capacity` bytes of logs, blobs and spools together.
  explicit MemoryStore(size_t capacity);

  absl::Status Append(const std::string& session, const storage::v1::LogEntry& entry) override;
  absl::StatusOr<std::vector<storage::v1::LogEntry>> Read(const std::string& session,
                                                          uint64_t after,
                                                          size_t limit) const override;
  absl::Status Compact(const std::string& session,
                       const std::vector<storage::v1::LogEntry>& entries) override;
  absl::StatusOr<std::vector<std::string>> Sessions() const override;
  absl::Status PutLog(const std::string& session, const std::string& spool) override;
  absl::Status Drop(const std::string& session) override;
  absl::Status DropByRequest(const DeletionRecord& deletion) override;
  absl::StatusOr<std::vector<DeletionRecord>> Deletions() const override;
  absl::Status PutSnapshot(const std::string& session, const SnapshotRecord& snapshot) override;
  absl::StatusOr<std::vector<SnapshotRecord>> Snapshots(const std::string& session) const override;
  absl::Status DropSnapshot(const std::string& session, uint64_t sequence) override;
  absl::StatusOr<int> BeginWork(const std::string& session, const std::string& work) override;
  absl::Status EndWork(const std::string& session, const std::string& work) override;
  absl::StatusOr<std::string> PutBlob(absl::string_view bytes) override;
  absl::Status PutSpool(const std::string& spool, const std::string& sha256) override;
  absl::StatusOr<int64_t> BlobSize(const std::string& sha256) const override;
  absl::StatusOr<std::string> GetBlob(const std::string& sha256) const override;
  absl::Status ReleaseBlob(const std::string& sha256) override;
  absl::Status KeepBlobs(const std::map<std::string, int>& holders) override;
  absl::Status KeepAllBlobs(const std::map<std::string, int>& holders) override;
  absl::Status AppendSpool(const std::string& spool, absl::string_view record) override;
  absl::Status SyncSpool(const std::string& spool) override;
  absl::Status CutSpool(const std::string& spool, size_t records) override;
  absl::Status ReadSpool(const std::string& spool,
                         absl::FunctionRef<absl::Status(absl::string_view)> visit) const override;
  absl::StatusOr<FileDescriptor> OpenSpool(const std::string& spool) const override;
  absl::StatusOr<int64_t> FreeBytes() const override;
  absl::Status DropSpool(const std::string& spool) override;
  absl::StatusOr<std::vector<std::string>> Spools() const override;
  absl::StatusOr<absl::Duration> SeenTime() const override;
  absl::Status PutSeenTime(absl::Duration seen) override;

  size_t used() const;

 private:
  struct Blob {
    std::string bytes;
    int holders = 0;
  };

  absl::Status Reserve(size_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status DropLog(const std::string& session) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const size_t capacity_;
  mutable std::mutex mutex_;
  size_t used_ ABSL_GUARDED_BY(mutex_) = 0;
  // By session and sequence number; entries in the form in which they would be written to disk, so
  // that reading them takes the same path.
  std::map<std::string, std::map<uint64_t, std::string>> logs_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::map<uint64_t, SnapshotRecord>> snapshots_ ABSL_GUARDED_BY(mutex_);
  // By session and name of the work: how often it was begun.
  std::map<std::string, std::map<std::string, int>> begun_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, Blob> blobs_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::vector<std::string>> spools_ ABSL_GUARDED_BY(mutex_);
  std::deque<DeletionRecord> deletions_ ABSL_GUARDED_BY(mutex_);
  absl::Duration seen_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_MEMORY_STORE_H_
