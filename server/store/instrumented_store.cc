#include "server/store/instrumented_store.h"

#include <chrono>

#include "absl/functional/function_ref.h"
#include "server/contract/error.h"

namespace vantage::store {
namespace {

const absl::Status& StatusOf(const absl::Status& status) { return status; }
template <typename T>
const absl::Status& StatusOf(const absl::StatusOr<T>& status) {
  return status.status();
}

// The message for clients, with what to do. It does not name the server's files; the log does.
absl::Status WithoutPaths(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kResourceExhausted:
      return contract::ErrorWithReason(status.code(), "STORE_FULL",
                                       "the server has no room left to store it; nothing was "
                                       "changed: delete sessions, or have its operator make room");
    case absl::StatusCode::kNotFound:
      return {status.code(), "the server has stored nothing of that name"};
    case absl::StatusCode::kAborted:
      return {status.code(), "somebody else writes the session"};
    case absl::StatusCode::kUnavailable:
      return {status.code(), "the server's storage fails; try again, and tell its operator"};
    case absl::StatusCode::kDataLoss:
      return {status.code(),
              "what the server stored of it is damaged; have its operator restore a "
              "backup"};
    default:
      return {status.code(), "the server's storage fails; its log says how"};
  }
}

template <typename Step>
auto Instrumented(telemetry::Metrics& metrics, telemetry::Log& log, const char* operation,
                  Step&& step) {
  const auto begun = std::chrono::steady_clock::now();
  auto result = step();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  metrics
      .HistogramOf("vantage_store_seconds", "Time that a step of the store took.",
                   {{"operation", operation}})
      .Observe(took.count());
  const absl::Status& status = StatusOf(result);
  if (status.ok()) return result;
  if (absl::IsNotFound(status) || absl::IsAborted(status)) {
    log.Info("the store does not have it, or not any more",
             {{"operation", operation}, {"answer", status.ToString()}});
  } else {
    metrics
        .CounterOf("vantage_store_errors_total", "Steps of the store that failed.",
                   {{"operation", operation}, {"code", absl::StatusCodeToString(status.code())}})
        .Add();
    log.Error("a step of the store failed",
              {{"operation", operation}, {"error", status.ToString()}});
  }
  return decltype(result)(WithoutPaths(status));
}

}  // namespace

absl::Status InstrumentedStore::Append(const std::string& session,
                                       const storage::v1::LogEntry& entry) {
  return Instrumented(metrics_, log_, "append", [&] { return store_.Append(session, entry); });
}
absl::StatusOr<std::vector<storage::v1::LogEntry>> InstrumentedStore::Read(
    const std::string& session, uint64_t after, size_t limit) const {
  return Instrumented(metrics_, log_, "read", [&] { return store_.Read(session, after, limit); });
}
absl::Status InstrumentedStore::Compact(const std::string& session,
                                        const std::vector<storage::v1::LogEntry>& entries) {
  return Instrumented(metrics_, log_, "compact", [&] { return store_.Compact(session, entries); });
}
absl::StatusOr<std::vector<std::string>> InstrumentedStore::Sessions() const {
  return Instrumented(metrics_, log_, "sessions", [&] { return store_.Sessions(); });
}
absl::Status InstrumentedStore::PutLog(const std::string& session, const std::string& spool) {
  return Instrumented(metrics_, log_, "put_log", [&] { return store_.PutLog(session, spool); });
}
absl::Status InstrumentedStore::Drop(const std::string& session) {
  return Instrumented(metrics_, log_, "drop", [&] { return store_.Drop(session); });
}
absl::Status InstrumentedStore::DropByRequest(const DeletionRecord& deletion) {
  return Instrumented(metrics_, log_, "drop", [&] { return store_.DropByRequest(deletion); });
}
absl::StatusOr<std::vector<DeletionRecord>> InstrumentedStore::Deletions() const {
  return Instrumented(metrics_, log_, "deletions", [&] { return store_.Deletions(); });
}
absl::Status InstrumentedStore::PutSnapshot(const std::string& session,
                                            const SnapshotRecord& snapshot) {
  return Instrumented(metrics_, log_, "put_snapshot",
                      [&] { return store_.PutSnapshot(session, snapshot); });
}
absl::StatusOr<std::vector<SnapshotRecord>> InstrumentedStore::Snapshots(
    const std::string& session) const {
  return Instrumented(metrics_, log_, "snapshots", [&] { return store_.Snapshots(session); });
}
absl::Status InstrumentedStore::DropSnapshot(const std::string& session, uint64_t sequence) {
  return Instrumented(metrics_, log_, "drop_snapshot",
                      [&] { return store_.DropSnapshot(session, sequence); });
}
absl::StatusOr<int> InstrumentedStore::BeginWork(const std::string& session,
                                                 const std::string& work) {
  return Instrumented(metrics_, log_, "begin_work",
                      [&] { return store_.BeginWork(session, work); });
}
absl::Status InstrumentedStore::EndWork(const std::string& session, const std::string& work) {
  return Instrumented(metrics_, log_, "end_work", [&] { return store_.EndWork(session, work); });
}
absl::StatusOr<std::string> InstrumentedStore::PutBlob(absl::string_view bytes) {
  return Instrumented(metrics_, log_, "put_blob", [&] { return store_.PutBlob(bytes); });
}
absl::Status InstrumentedStore::PutSpool(const std::string& spool, const std::string& sha256) {
  return Instrumented(metrics_, log_, "put_spool", [&] { return store_.PutSpool(spool, sha256); });
}
absl::StatusOr<int64_t> InstrumentedStore::BlobSize(const std::string& sha256) const {
  return Instrumented(metrics_, log_, "blob_size", [&] { return store_.BlobSize(sha256); });
}
absl::StatusOr<std::string> InstrumentedStore::GetBlob(const std::string& sha256) const {
  return Instrumented(metrics_, log_, "get_blob", [&] { return store_.GetBlob(sha256); });
}
absl::Status InstrumentedStore::ReleaseBlob(const std::string& sha256) {
  return Instrumented(metrics_, log_, "release_blob", [&] { return store_.ReleaseBlob(sha256); });
}
absl::Status InstrumentedStore::KeepBlobs(const std::map<std::string, int>& holders) {
  return Instrumented(metrics_, log_, "keep_blobs", [&] { return store_.KeepBlobs(holders); });
}
absl::Status InstrumentedStore::KeepAllBlobs(const std::map<std::string, int>& holders) {
  return Instrumented(metrics_, log_, "keep_blobs", [&] { return store_.KeepAllBlobs(holders); });
}
absl::Status InstrumentedStore::AppendSpool(const std::string& spool, absl::string_view record) {
  return Instrumented(metrics_, log_, "append_spool",
                      [&] { return store_.AppendSpool(spool, record); });
}
absl::Status InstrumentedStore::SyncSpool(const std::string& spool) {
  return Instrumented(metrics_, log_, "sync_spool", [&] { return store_.SyncSpool(spool); });
}
absl::Status InstrumentedStore::CutSpool(const std::string& spool, size_t records) {
  return Instrumented(metrics_, log_, "cut_spool", [&] { return store_.CutSpool(spool, records); });
}
absl::Status InstrumentedStore::ReadSpool(
    const std::string& spool, absl::FunctionRef<absl::Status(absl::string_view)> visit) const {
  return Instrumented(metrics_, log_, "read_spool", [&] { return store_.ReadSpool(spool, visit); });
}
absl::StatusOr<FileDescriptor> InstrumentedStore::OpenSpool(const std::string& spool) const {
  return Instrumented(metrics_, log_, "open_spool", [&] { return store_.OpenSpool(spool); });
}
absl::StatusOr<int64_t> InstrumentedStore::FreeBytes() const {
  return Instrumented(metrics_, log_, "free_bytes", [&] { return store_.FreeBytes(); });
}
absl::Status InstrumentedStore::DropSpool(const std::string& spool) {
  return Instrumented(metrics_, log_, "drop_spool", [&] { return store_.DropSpool(spool); });
}
absl::StatusOr<std::vector<std::string>> InstrumentedStore::Spools() const {
  return Instrumented(metrics_, log_, "spools", [&] { return store_.Spools(); });
}
absl::StatusOr<absl::Duration> InstrumentedStore::SeenTime() const {
  return Instrumented(metrics_, log_, "seen_time", [&] { return store_.SeenTime(); });
}
absl::Status InstrumentedStore::PutSeenTime(absl::Duration seen) {
  return Instrumented(metrics_, log_, "put_seen_time", [&] { return store_.PutSeenTime(seen); });
}

}  // namespace vantage::store
