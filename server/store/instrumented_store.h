// A store whose every step is timed and whose failures are counted.
#ifndef VANTAGE_SERVER_STORE_INSTRUMENTED_STORE_H_
#define VANTAGE_SERVER_STORE_INSTRUMENTED_STORE_H_

#include <map>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"

namespace vantage::store {

// vantage_store_seconds{operation} and vantage_store_errors_total{operation,code}. NOT_FOUND and
// ABORTED are answers, not failures. What goes wrong keeps its code and gets a message that a
// client may see; the store's own, which may name paths, is in the log. RESOURCE_EXHAUSTED has the
// reason STORE_FULL. Thread safe; what it is made of outlives it.
class InstrumentedStore final : public Store {
 public:
  InstrumentedStore(Store& store, telemetry::Metrics& metrics, telemetry::Log& log)
      : store_(store), metrics_(metrics), log_(log) {}

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
  Store& store_;
  telemetry::Metrics& metrics_;
  telemetry::Log& log_;
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_INSTRUMENTED_STORE_H_
