// A store in one folder: what returned OK is there after a crash or a power cut.
//
//   logs.sqlite       the sessions' logs (log_database.h)
//   blobs/ab/abcd...  committed scans and whole plans, named by their SHA-256 (blob_folder.h)
//   spools/           what came of uploads that are under way (spool_folder.h)
//   lock              held by the one process that uses the folder
//   unfinished        while a backup or a restore writes here (store_folder.h)
#ifndef VANTAGE_SERVER_STORE_DISK_STORE_H_
#define VANTAGE_SERVER_STORE_DISK_STORE_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/store/blob_folder.h"
#include "server/store/durable_file.h"
#include "server/store/log_database.h"
#include "server/store/spool_folder.h"
#include "server/store/store.h"

namespace vantage::store {

class DiskStore final : public Store {
 public:
  // Opens or makes it. FAILED_PRECONDITION: another process uses the folder, a newer release wrote
  // it, a copy to it was broken off, or it has scans without the logs that name them. DATA_LOSS:
  // damaged. UNAVAILABLE: it cannot be written.
  static absl::StatusOr<std::unique_ptr<DiskStore>> Open(const std::string& folder);

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

 private:
  DiskStore(const std::string& folder, FileDescriptor lock);

  const FileDescriptor lock_;
  BlobFolder blobs_;
  SpoolFolder spools_;
  std::unique_ptr<LogDatabase> logs_;
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_DISK_STORE_H_
