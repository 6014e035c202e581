#include "server/store/backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "server/store/blob_folder.h"
#include "server/store/durable_file.h"
#include "server/store/log_database.h"
#include "server/store/spool_folder.h"
#include "server/store/store_folder.h"
#include "server/store/upgrade.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

constexpr size_t kBatch = 256;

absl::Status CopyFile(const std::string& from, const std::string& to) {
  const absl::StatusOr<std::string> bytes = ReadWhole(from);
  if (!bytes.ok()) return bytes.status();
  return ReplaceFile(to, to + ".new", *bytes);
}

// Copies every file of a folder that `to` lacks; files that are deleted meanwhile are left out.
// They are copied, never linked: what damages one of two names of a file damages both.
absl::Status CopyFiles(const std::string& from, const std::string& to) {
  std::error_code error;
  for (fs::recursive_directory_iterator file(from, error), end; file != end && !error;
       file.increment(error)) {
    if (!file->is_regular_file(error)) continue;
    const std::string target =
        absl::StrCat(to, "/", fs::relative(file->path(), from, error).string());
    if (fs::exists(target, error)) continue;
    const std::string parent = fs::path(target).parent_path().string();
    if (absl::Status made = MakeFolder(parent); !made.ok()) return made;
    absl::Status copied = CopyFile(file->path().string(), target);
    if (!copied.ok() && !absl::IsNotFound(copied)) return copied;
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return absl::UnavailableError(absl::StrCat("cannot list ", from, ": ", error.message()));
  }
  return absl::OkStatus();
}

// Checks a session's log, and adds the blobs that its scans need to `needed`.
absl::Status VerifyLog(const LogDatabase& logs, const std::string& session, StoreReport& report,
                       std::set<std::string>& needed) {
  uint64_t after = 0;
  std::map<std::string, std::string> scans;  // their blobs, by name
  while (true) {
    const absl::StatusOr<std::vector<std::string>> batch = logs.Read(session, after, kBatch);
    if (!batch.ok()) return batch.status();
    for (const std::string& bytes : *batch) {
      storage::v1::LogEntry entry;
      if (!entry.ParseFromString(bytes)) {
        return absl::DataLossError(absl::StrCat("session ", session, ": an entry is unreadable"));
      }
      Upgrade(entry);
      const v1::SessionEvent& event = entry.event();
      if (event.has_scan_received()) scans[event.scan_received().scan().name()] = entry.blob();
      if (event.has_scan_replaced()) scans[event.scan_replaced().scan().name()] = entry.blob();
      const v1::Scan& withdrawn = event.scan_withdrawn().scan();
      if (event.has_scan_withdrawn() && withdrawn.encoded_size_bytes() == 0) {
        scans.erase(withdrawn.name());  // its data were erased
      }
      ++report.entries;
      after = event.sequence();
    }
    if (batch->size() < kBatch) break;
  }
  for (const auto& [name, blob] : scans) needed.insert(blob);
  return absl::OkStatus();
}

// A session that was deleted while it was copied may lack scans, so it is removed from the copy,
// too. A missing scan of a session that is still there is lost, and is reported.
absl::Status DropDeleted(const LogDatabase& live, const std::string& to) {
  const absl::StatusOr<std::vector<std::string>> there = BlobFolder(BlobsIn(to)).List();
  if (!there.ok()) return there.status();
  const std::set<std::string> copied(there->begin(), there->end());
  const absl::StatusOr<std::unique_ptr<LogDatabase>> copy = LogDatabase::Open(DatabaseIn(to));
  if (!copy.ok()) return copy.status();
  const absl::StatusOr<std::vector<std::string>> sessions = (*copy)->Sessions();
  if (!sessions.ok()) return sessions.status();
  for (const std::string& session : *sessions) {
    StoreReport unused;
    std::set<std::string> needed;
    std::set<std::string> still;
    if (!VerifyLog(**copy, session, unused, needed).ok()) continue;
    absl::Status read = VerifyLog(live, session, unused, still);
    if (!read.ok() && !absl::IsNotFound(read)) return read;
    bool deleted = false;
    for (const std::string& sha256 : needed) {
      deleted = deleted || (copied.count(sha256) == 0 && still.count(sha256) == 0);
    }
    if (!deleted) continue;
    if (absl::Status dropped = (*copy)->Drop(session); !dropped.ok()) return dropped;
  }
  return absl::OkStatus();
}

absl::Status RemoveFolder(const std::string& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot remove ", folder, ": ", error.message()));
}

// What VerifyStore() says, but for copies that were broken off.
absl::StatusOr<StoreReport> VerifyFiles(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(DatabaseIn(folder), error)) {
    return absl::NotFoundError(absl::StrCat("no sessions are kept in ", folder));
  }
  const absl::StatusOr<std::unique_ptr<LogDatabase>> logs =
      LogDatabase::OpenToRead(DatabaseIn(folder));
  if (!logs.ok()) return logs.status();
  StoreReport report;
  if (absl::Status sound = (*logs)->Check(); !sound.ok()) {
    report.faults.emplace_back(sound.message());
  }
  const absl::StatusOr<std::vector<std::string>> sessions = (*logs)->Sessions();
  if (!sessions.ok()) return sessions.status();
  std::set<std::string> needed;
  for (const std::string& session : *sessions) {
    const absl::Status sound = VerifyLog(**logs, session, report, needed);
    if (absl::IsNotFound(sound)) continue;  // deleted meanwhile
    ++report.sessions;
    if (!sound.ok()) report.faults.emplace_back(sound.message());
  }
  const BlobFolder blobs(BlobsIn(folder));
  const absl::StatusOr<std::vector<std::string>> there = blobs.List();
  if (!there.ok()) return there.status();
  for (const std::string& sha256 : *there) {
    const absl::StatusOr<std::string> bytes = blobs.Get(sha256);
    if (absl::IsNotFound(bytes.status())) continue;
    ++report.blobs;
    needed.erase(sha256);
    if (bytes.ok()) report.blob_bytes += static_cast<int64_t>(bytes->size());
    if (!bytes.ok()) report.faults.emplace_back(bytes.status().message());
  }
  for (const std::string& sha256 : needed) {
    report.faults.push_back(
        absl::StrCat("the scan with SHA-256 ", absl::BytesToHexString(sha256), " is missing"));
  }
  const SpoolFolder spools(SpoolsIn(folder));
  const absl::StatusOr<std::vector<std::string>> uploads = spools.List();
  if (!uploads.ok()) return uploads.status();
  for (const std::string& upload : *uploads) {
    ++report.uploads;
    const absl::Status sound = spools.Check(upload);
    if (!sound.ok()) report.faults.emplace_back(sound.message());
  }
  return report;
}

// Reads again what was written, and only then takes the mark of an unfinished copy away.
absl::StatusOr<StoreReport> FinishCopy(const std::string& to) {
  absl::StatusOr<StoreReport> copy = VerifyFiles(to);
  if (!copy.ok()) return copy;
  if (!copy->faults.empty()) {
    return absl::DataLossError(
        absl::StrCat("the copy in ", to, " is not sound: ", copy->faults[0]));
  }
  if (absl::Status ended = EndCopy(to); !ended.ok()) return ended;
  return copy;
}

}  // namespace

absl::StatusOr<StoreReport> VerifyStore(const std::string& folder) {
  absl::StatusOr<StoreReport> report = VerifyFiles(folder);
  if (!report.ok()) return report;
  if (absl::Status whole = CheckFinished(folder); !whole.ok()) {
    report->faults.emplace_back(whole.message());
  }
  return report;
}

absl::StatusOr<StoreReport> BackUpStore(const std::string& from, const std::string& to) {
  std::error_code error;
  if (!fs::exists(DatabaseIn(from), error)) {
    return absl::NotFoundError(absl::StrCat("no sessions are kept in ", from));
  }
  absl::Status status = CheckNewFolder(to);
  if (status.ok()) status = BeginCopy(to, "backup", from);
  if (status.ok()) status = MakeFolder(BlobsIn(to));
  if (status.ok()) status = MakeFolder(SpoolsIn(to));
  // Blobs are copied before the logs, in case they are released meanwhile, and again after, for
  // those that were added.
  if (status.ok()) status = CopyFiles(BlobsIn(from), BlobsIn(to));
  if (!status.ok()) return status;
  const absl::StatusOr<std::unique_ptr<LogDatabase>> logs =
      LogDatabase::OpenToRead(DatabaseIn(from));
  if (!logs.ok()) return logs.status();
  status = (*logs)->CopyTo(DatabaseIn(to));
  if (status.ok()) status = CopyFiles(BlobsIn(from), BlobsIn(to));
  if (status.ok()) status = DropDeleted(**logs, to);
  // Spools grow meanwhile: a copy that is cut short ends with the last whole record.
  if (status.ok()) status = CopyFiles(SpoolsIn(from), SpoolsIn(to));
  if (status.ok()) status = SyncFolder(to);
  if (!status.ok()) return status;
  return FinishCopy(to);
}

absl::StatusOr<StoreReport> RestoreStore(const std::string& from, const std::string& to) {
  absl::StatusOr<StoreReport> backup = VerifyStore(from);
  if (!backup.ok()) return backup;
  if (!backup->faults.empty()) {
    return absl::DataLossError(
        absl::StrCat("the backup in ", from, " is not sound: ", backup->faults[0]));
  }
  // One that was broken off goes on: each file that is there is whole. Spools are the exception,
  // which have the same names in another backup.
  const bool goes_on = IsCopyOf(to, "restore", from);
  absl::Status status = goes_on ? absl::OkStatus() : CheckNewFolder(to);
  if (status.ok()) status = BeginCopy(to, "restore", from);
  if (status.ok()) status = MakeFolder(BlobsIn(to));
  if (status.ok()) status = CopyFiles(BlobsIn(from), BlobsIn(to));
  if (status.ok()) status = RemoveFolder(SpoolsIn(to));
  if (status.ok()) status = MakeFolder(SpoolsIn(to));
  if (status.ok()) status = CopyFiles(SpoolsIn(from), SpoolsIn(to));
  if (status.ok()) status = CopyFile(DatabaseIn(from), DatabaseIn(to));
  if (!status.ok()) return status;
  return FinishCopy(to);
}

}  // namespace vantage::store
