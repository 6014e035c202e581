#include "server/store/disk_store.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/store/left_out.h"
#include "server/store/store_folder.h"
#include "server/store/upgrade.h"

namespace vantage::store {

DiskStore::DiskStore(const std::string& folder, FileDescriptor lock)
    : lock_(std::move(lock)), blobs_(BlobsIn(folder)), spools_(SpoolsIn(folder)) {}

absl::StatusOr<std::unique_ptr<DiskStore>> DiskStore::Open(const std::string& folder) {
  if (absl::Status made = MakeFolder(folder); !made.ok()) return made;
  const std::string lock_path = absl::StrCat(folder, "/lock");
  FileDescriptor lock(::open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock.ok()) return FileError("cannot open", lock_path);
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return FileError("cannot lock", lock_path);
    return absl::FailedPreconditionError(absl::StrCat("another server uses the data in ", folder));
  }
  if (absl::Status finished = CheckFinished(folder); !finished.ok()) return finished;
  if (absl::Status known = CheckNotWithoutLogs(folder); !known.ok()) return known;
  std::unique_ptr<DiskStore> store(new DiskStore(folder, std::move(lock)));
  absl::StatusOr<std::unique_ptr<LogDatabase>> logs = LogDatabase::Open(DatabaseIn(folder));
  if (!logs.ok()) return logs.status();
  store->logs_ = *std::move(logs);
  if (absl::Status opened = store->blobs_.Open(); !opened.ok()) return opened;
  if (absl::Status opened = store->spools_.Open(); !opened.ok()) return opened;
  // The names of the database's files.
  if (absl::Status synced = SyncFolder(folder); !synced.ok()) return synced;
  return store;
}

absl::Status DiskStore::Append(const std::string& session, const storage::v1::LogEntry& entry) {
  return logs_->Append(session, entry.event().sequence(), entry.SerializeAsString());
}

absl::StatusOr<std::vector<storage::v1::LogEntry>> DiskStore::Read(const std::string& session,
                                                                   uint64_t after,
                                                                   size_t limit) const {
  const absl::StatusOr<std::vector<std::string>> bytes = logs_->Read(session, after, limit);
  if (!bytes.ok()) return bytes.status();
  std::vector<storage::v1::LogEntry> entries(bytes->size());
  for (size_t i = 0; i < entries.size(); ++i) {
    if (!entries[i].ParseFromString((*bytes)[i])) {
      return absl::DataLossError(absl::StrCat("log of ", session, " is damaged"));
    }
    Upgrade(entries[i]);
  }
  return entries;
}

absl::Status DiskStore::Compact(const std::string& session,
                                const std::vector<storage::v1::LogEntry>& entries) {
  std::vector<LogDatabase::Stub> stubs;
  stubs.reserve(entries.size());
  for (const storage::v1::LogEntry& entry : entries) {
    stubs.push_back(
        {FirstSequence(entry.event()), entry.event().sequence(), entry.SerializeAsString()});
  }
  return logs_->Compact(session, stubs);
}

absl::StatusOr<std::vector<std::string>> DiskStore::Sessions() const { return logs_->Sessions(); }

absl::Status DiskStore::PutLog(const std::string& session, const std::string& spool) {
  return logs_->PutLog(session, [&](LogDatabase::TakeEntry take) {
    return spools_.Read(spool, [&](absl::string_view record) -> absl::Status {
      storage::v1::LogEntry entry;
      if (!entry.ParseFromArray(record.data(), static_cast<int>(record.size()))) {
        return absl::DataLossError(absl::StrCat("an entry of ", session, " is damaged"));
      }
      return take(FirstSequence(entry.event()), entry.event().sequence(), record);
    });
  });
}

absl::Status DiskStore::Drop(const std::string& session) { return logs_->Drop(session); }

absl::Status DiskStore::DropByRequest(const DeletionRecord& deletion) {
  return logs_->DropByRequest(deletion);
}

absl::StatusOr<std::vector<DeletionRecord>> DiskStore::Deletions() const {
  return logs_->Deletions();
}

absl::Status DiskStore::PutSnapshot(const std::string& session, const SnapshotRecord& snapshot) {
  return logs_->PutSnapshot(session, snapshot);
}

absl::StatusOr<int> DiskStore::BeginWork(const std::string& session, const std::string& work) {
  return logs_->BeginWork(session, work);
}

absl::Status DiskStore::EndWork(const std::string& session, const std::string& work) {
  return logs_->EndWork(session, work);
}

absl::StatusOr<std::vector<SnapshotRecord>> DiskStore::Snapshots(const std::string& session) const {
  return logs_->Snapshots(session);
}

absl::Status DiskStore::DropSnapshot(const std::string& session, uint64_t sequence) {
  return logs_->DropSnapshot(session, sequence);
}

absl::StatusOr<std::string> DiskStore::PutBlob(absl::string_view bytes) {
  return blobs_.Put(bytes);
}

absl::Status DiskStore::PutSpool(const std::string& spool, const std::string& sha256) {
  return blobs_.PutRecords(spools_.FileOf(spool), sha256);
}

absl::StatusOr<int64_t> DiskStore::BlobSize(const std::string& sha256) const {
  return blobs_.Size(sha256);
}

absl::StatusOr<std::string> DiskStore::GetBlob(const std::string& sha256) const {
  return blobs_.Get(sha256);
}

absl::Status DiskStore::ReleaseBlob(const std::string& sha256) { return blobs_.Release(sha256); }

absl::Status DiskStore::KeepBlobs(const std::map<std::string, int>& holders) {
  return blobs_.Keep(holders);
}

absl::Status DiskStore::KeepAllBlobs(const std::map<std::string, int>& holders) {
  return blobs_.KeepAll(holders);
}

absl::StatusOr<absl::Duration> DiskStore::SeenTime() const { return logs_->SeenTime(); }

absl::Status DiskStore::PutSeenTime(absl::Duration seen) { return logs_->PutSeenTime(seen); }

absl::Status DiskStore::AppendSpool(const std::string& spool, absl::string_view record) {
  return spools_.Append(spool, record);
}

absl::Status DiskStore::SyncSpool(const std::string& spool) { return spools_.Sync(spool); }

absl::Status DiskStore::CutSpool(const std::string& spool, size_t records) {
  return spools_.Cut(spool, records);
}

absl::Status DiskStore::ReadSpool(const std::string& spool,
                                  absl::FunctionRef<absl::Status(absl::string_view)> visit) const {
  return spools_.Read(spool, visit);
}

absl::StatusOr<FileDescriptor> DiskStore::OpenSpool(const std::string& spool) const {
  return spools_.OpenBytes(spool);
}

absl::StatusOr<int64_t> DiskStore::FreeBytes() const { return spools_.FreeBytes(); }

absl::Status DiskStore::DropSpool(const std::string& spool) { return spools_.Drop(spool); }

absl::StatusOr<std::vector<std::string>> DiskStore::Spools() const { return spools_.List(); }

}  // namespace vantage::store
