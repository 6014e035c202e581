#include "server/store/observed_store.h"

#include <chrono>

#include "absl/functional/function_ref.h"

namespace vantage {
namespace {

const absl::Status& StatusOf(const absl::Status& status) { return status; }
template <typename T>
const absl::Status& StatusOf(const absl::StatusOr<T>& status) {
  return status.status();
}

template <typename Step>
auto Observed(Metrics& metrics, const char* operation, Step&& step) {
  const auto begun = std::chrono::steady_clock::now();
  auto result = step();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  metrics
      .HistogramOf("vantage_store_seconds", "Time that a step of the store took.",
                   {{"operation", operation}})
      .Observe(took.count());
  const absl::Status& status = StatusOf(result);
  if (!status.ok() && !absl::IsNotFound(status) && !absl::IsAborted(status)) {
    metrics
        .CounterOf("vantage_store_errors_total", "Steps of the store that failed.",
                   {{"operation", operation}, {"code", absl::StatusCodeToString(status.code())}})
        .Add();
  }
  return result;
}

}  // namespace

absl::Status ObservedStore::Append(const std::string& session, const store::v1::LogEntry& entry) {
  return Observed(metrics_, "append", [&] { return store_.Append(session, entry); });
}
absl::StatusOr<std::vector<store::v1::LogEntry>> ObservedStore::Read(const std::string& session,
                                                                     uint64_t after,
                                                                     size_t limit) const {
  return Observed(metrics_, "read", [&] { return store_.Read(session, after, limit); });
}
absl::StatusOr<std::vector<std::string>> ObservedStore::Sessions() const {
  return Observed(metrics_, "sessions", [&] { return store_.Sessions(); });
}
absl::Status ObservedStore::Drop(const std::string& session) {
  return Observed(metrics_, "drop", [&] { return store_.Drop(session); });
}
absl::Status ObservedStore::PutSnapshot(const std::string& session,
                                        const SnapshotRecord& snapshot) {
  return Observed(metrics_, "put_snapshot", [&] { return store_.PutSnapshot(session, snapshot); });
}
absl::StatusOr<std::vector<SnapshotRecord>> ObservedStore::Snapshots(
    const std::string& session) const {
  return Observed(metrics_, "snapshots", [&] { return store_.Snapshots(session); });
}
absl::Status ObservedStore::DropSnapshot(const std::string& session, uint64_t sequence) {
  return Observed(metrics_, "drop_snapshot",
                  [&] { return store_.DropSnapshot(session, sequence); });
}
absl::StatusOr<std::string> ObservedStore::PutBlob(absl::string_view bytes) {
  return Observed(metrics_, "put_blob", [&] { return store_.PutBlob(bytes); });
}
absl::Status ObservedStore::PutSpool(const std::string& spool, const std::string& sha256) {
  return Observed(metrics_, "put_spool", [&] { return store_.PutSpool(spool, sha256); });
}
absl::StatusOr<int64_t> ObservedStore::BlobSize(const std::string& sha256) const {
  return Observed(metrics_, "blob_size", [&] { return store_.BlobSize(sha256); });
}
absl::StatusOr<std::string> ObservedStore::GetBlob(const std::string& sha256) const {
  return Observed(metrics_, "get_blob", [&] { return store_.GetBlob(sha256); });
}
absl::Status ObservedStore::ReleaseBlob(const std::string& sha256) {
  return Observed(metrics_, "release_blob", [&] { return store_.ReleaseBlob(sha256); });
}
absl::Status ObservedStore::KeepBlobs(const std::map<std::string, int>& holders) {
  return Observed(metrics_, "keep_blobs", [&] { return store_.KeepBlobs(holders); });
}
absl::Status ObservedStore::AppendSpool(const std::string& spool, absl::string_view record) {
  return Observed(metrics_, "append_spool", [&] { return store_.AppendSpool(spool, record); });
}
absl::Status ObservedStore::SyncSpool(const std::string& spool) {
  return Observed(metrics_, "sync_spool", [&] { return store_.SyncSpool(spool); });
}
absl::Status ObservedStore::CutSpool(const std::string& spool, size_t records) {
  return Observed(metrics_, "cut_spool", [&] { return store_.CutSpool(spool, records); });
}
absl::Status ObservedStore::ReadSpool(
    const std::string& spool, absl::FunctionRef<absl::Status(absl::string_view)> visit) const {
  return Observed(metrics_, "read_spool", [&] { return store_.ReadSpool(spool, visit); });
}
absl::Status ObservedStore::DropSpool(const std::string& spool) {
  return Observed(metrics_, "drop_spool", [&] { return store_.DropSpool(spool); });
}
absl::StatusOr<std::vector<std::string>> ObservedStore::Spools() const {
  return Observed(metrics_, "spools", [&] { return store_.Spools(); });
}

}  // namespace vantage
