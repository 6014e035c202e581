// The sessions' logs in a SQLite database: write-ahead logging, every commit synced.
#ifndef VANTAGE_SERVER_STORE_LOG_DATABASE_H_
#define VANTAGE_SERVER_STORE_LOG_DATABASE_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/store/store.h"

namespace vantage::store {

// Thread safe: one writes while another reads. Methods as the store's (store.h).
class LogDatabase {
 public:
  // The newest schema that is read. New databases have schema 1; tables that an older release does
  // not need do not raise it, so that a folder can go back by one release. Schema 2 says that
  // entries were left out of a log, which an older release would take for damage.
  static constexpr int kSchemaVersion = 2;

  // FAILED_PRECONDITION: written by a newer release. DATA_LOSS: not a database, or damaged.
  static absl::StatusOr<std::unique_ptr<LogDatabase>> Open(const std::string& path);
  // Opens a database for reading only, beside the process that writes. Errors as above;
  // UNAVAILABLE: no such file.
  static absl::StatusOr<std::unique_ptr<LogDatabase>> OpenToRead(const std::string& path);
  ~LogDatabase();

  absl::Status Append(const std::string& session, uint64_t sequence, absl::string_view entry);
  absl::StatusOr<std::vector<std::string>> Read(const std::string& session, uint64_t after,
                                                size_t limit) const;
  // All entries of a session that are sound, in order; adds what is damaged or missing to `faults`,
  // in words. NOT_FOUND.
  absl::StatusOr<std::vector<std::string>> ReadSound(const std::string& session,
                                                     std::vector<std::string>& faults) const;
  // An entry that stands for those from `first` to `last`.
  struct Stub {
    uint64_t first = 0;
    uint64_t last = 0;
    std::string entry;
  };
  absl::Status Compact(const std::string& session, const std::vector<Stub>& stubs);
  absl::StatusOr<std::vector<std::string>> Sessions() const;
  // Takes an entry that stands for those from `first` to `last`, mostly one.
  using TakeEntry =
      absl::FunctionRef<absl::Status(uint64_t first, uint64_t last, absl::string_view entry)>;
  // Writes what `entries` gives, in one step. ABORTED: the session has a log, or an entry that is
  // given is not the next, or none is.
  absl::Status PutLog(const std::string& session,
                      absl::FunctionRef<absl::Status(TakeEntry)> entries);
  absl::Status Drop(const std::string& session);
  absl::Status DropByRequest(const DeletionRecord& deletion);
  absl::StatusOr<std::vector<DeletionRecord>> Deletions() const;

  absl::Status PutSnapshot(const std::string& session, const SnapshotRecord& snapshot);
  absl::StatusOr<std::vector<SnapshotRecord>> Snapshots(const std::string& session) const;
  absl::Status DropSnapshot(const std::string& session, uint64_t sequence);

  absl::StatusOr<absl::Duration> SeenTime() const;
  absl::Status PutSeenTime(absl::Duration seen);
  absl::StatusOr<int> BeginWork(const std::string& session, const std::string& work);
  absl::Status EndWork(const std::string& session, const std::string& work);

  // The database's own check of its file. DATA_LOSS.
  absl::Status Check() const;
  // Copies the whole database, as it is at one moment, to a new file. Durable.
  absl::Status CopyTo(const std::string& path) const;

 private:
  struct Connection;
  LogDatabase(std::string path, std::unique_ptr<Connection> writer,
              std::unique_ptr<Connection> reader);

  absl::Status PutStub(const std::string& session, const Stub& stub)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(write_mutex_);
  absl::Status DropLog(const std::string& session) ABSL_EXCLUSIVE_LOCKS_REQUIRED(write_mutex_);
  absl::Status Remember(const DeletionRecord& deletion) ABSL_EXCLUSIVE_LOCKS_REQUIRED(write_mutex_);
  // Ends a transaction that came to `status`: it counts as a whole or not at all.
  absl::Status EndTransaction(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(write_mutex_);
  // The write-ahead log still has what was deleted. If it cannot be emptied now, it is emptied at
  // the next start at the latest; the deletion stands.
  void EmptyWriteAheadLog() ABSL_EXCLUSIVE_LOCKS_REQUIRED(write_mutex_);

  const std::string path_;
  mutable std::mutex write_mutex_;
  mutable std::mutex read_mutex_;
  const std::unique_ptr<Connection> writer_;
  const std::unique_ptr<Connection> reader_;
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_LOG_DATABASE_H_
