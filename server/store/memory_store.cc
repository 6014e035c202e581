#include "server/store/memory_store.h"

#include <fcntl.h>
#include <sys/mman.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/store/left_out.h"
#include "server/store/piece_record.h"
#include "server/store/upgrade.h"

namespace vantage::store {

MemoryStore::MemoryStore(size_t capacity) : capacity_(capacity) {}

absl::Status MemoryStore::Reserve(size_t bytes) {
  if (bytes > capacity_ - used_) {
    return absl::ResourceExhaustedError(absl::StrCat("the store is full: ", used_, " of ",
                                                     capacity_, " bytes used, ", bytes,
                                                     " more needed; delete sessions"));
  }
  used_ += bytes;
  return absl::OkStatus();
}

absl::Status MemoryStore::Append(const std::string& session, const storage::v1::LogEntry& entry) {
  std::string bytes = entry.SerializeAsString();
  std::lock_guard<std::mutex> lock(mutex_);
  const auto log = logs_.find(session);
  const uint64_t next = log == logs_.end() ? 1 : log->second.rbegin()->first + 1;
  if (entry.event().sequence() != next) {
    return absl::AbortedError(absl::StrCat("session ", session, ": entry ",
                                           entry.event().sequence(), " where ", next, " is next"));
  }
  absl::Status room = Reserve(bytes.size());
  if (!room.ok()) return room;
  logs_[session][next] = std::move(bytes);
  return absl::OkStatus();
}

absl::Status MemoryStore::Compact(const std::string& session,
                                  const std::vector<storage::v1::LogEntry>& entries) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto log = logs_.find(session);
  if (log == logs_.end()) return absl::AbortedError(absl::StrCat("no log of ", session));
  std::map<uint64_t, std::string>& kept = log->second;
  for (const storage::v1::LogEntry& entry : entries) {
    const uint64_t first = FirstSequence(entry.event());
    const uint64_t last = entry.event().sequence();
    const auto before = kept.lower_bound(first);
    const bool begins = before != kept.begin() && std::prev(before)->first + 1 == first;
    if (first > last || !begins || kept.count(last) == 0 || kept.rbegin()->first == last) {
      return absl::AbortedError(absl::StrCat("session ", session, ": ", first, " to ", last,
                                             " are no entries to leave out"));
    }
  }
  for (const storage::v1::LogEntry& entry : entries) {
    const auto begin = kept.lower_bound(FirstSequence(entry.event()));
    const auto end = kept.upper_bound(entry.event().sequence());
    for (auto gone = begin; gone != end; ++gone) used_ -= gone->second.size();
    kept.erase(begin, end);
    // It is smaller than what it stands for, or may exceed the capacity by some bytes.
    std::string bytes = entry.SerializeAsString();
    used_ += bytes.size();
    kept[entry.event().sequence()] = std::move(bytes);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<storage::v1::LogEntry>> MemoryStore::Read(const std::string& session,
                                                                     uint64_t after,
                                                                     size_t limit) const {
  std::vector<std::string> bytes;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto log = logs_.find(session);
    if (log == logs_.end()) return absl::NotFoundError(absl::StrCat("no log of ", session));
    for (auto next = log->second.upper_bound(after);
         next != log->second.end() && bytes.size() < limit; ++next) {
      bytes.push_back(next->second);
    }
  }
  std::vector<storage::v1::LogEntry> entries(bytes.size());
  for (size_t i = 0; i < bytes.size(); ++i) {
    if (!entries[i].ParseFromString(bytes[i])) {
      return absl::DataLossError(absl::StrCat("log of ", session, " is damaged"));
    }
    Upgrade(entries[i]);
  }
  return entries;
}

absl::StatusOr<std::vector<std::string>> MemoryStore::Sessions() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> names;
  names.reserve(logs_.size());
  for (const auto& [name, log] : logs_) names.push_back(name);
  return names;
}

absl::Status MemoryStore::PutLog(const std::string& session, const std::string& spool) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (logs_.count(session) != 0) {
    return absl::AbortedError(absl::StrCat("session ", session, " has a log"));
  }
  std::map<uint64_t, std::string> log;
  size_t bytes = 0;
  uint64_t next = 1;
  const auto records = spools_.find(spool);
  if (records != spools_.end()) {
    for (const std::string& record : records->second) {
      storage::v1::LogEntry entry;
      if (!entry.ParseFromString(record) || FirstSequence(entry.event()) != next) break;
      next = entry.event().sequence() + 1;
      bytes += record.size();
      log[entry.event().sequence()] = record;
    }
  }
  if (log.empty() || log.size() != records->second.size()) {
    return absl::AbortedError(absl::StrCat("session ", session, ": entry ", next, " is missing"));
  }
  if (absl::Status room = Reserve(bytes); !room.ok()) return room;
  logs_[session] = std::move(log);
  return absl::OkStatus();
}

absl::Status MemoryStore::Drop(const std::string& session) {
  std::lock_guard<std::mutex> lock(mutex_);
  return DropLog(session);
}

absl::Status MemoryStore::DropByRequest(const DeletionRecord& deletion) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (absl::Status dropped = DropLog(deletion.session); !dropped.ok()) return dropped;
  deletions_.push_back(deletion);
  if (deletions_.size() > kRememberedDeletions) deletions_.pop_front();
  return absl::OkStatus();
}

absl::StatusOr<std::vector<DeletionRecord>> MemoryStore::Deletions() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return std::vector<DeletionRecord>(deletions_.begin(), deletions_.end());
}

absl::Status MemoryStore::DropLog(const std::string& session) {
  const auto log = logs_.find(session);
  if (log == logs_.end()) return absl::NotFoundError(absl::StrCat("no log of ", session));
  for (const auto& [sequence, entry] : log->second) used_ -= entry.size();
  logs_.erase(log);
  snapshots_.erase(session);
  begun_.erase(session);
  return absl::OkStatus();
}

absl::Status MemoryStore::PutSnapshot(const std::string& session, const SnapshotRecord& snapshot) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (logs_.find(session) == logs_.end()) {
    return absl::NotFoundError(absl::StrCat("no log of ", session));
  }
  snapshots_[session][snapshot.sequence] = snapshot;
  return absl::OkStatus();
}

absl::StatusOr<std::vector<SnapshotRecord>> MemoryStore::Snapshots(
    const std::string& session) const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<SnapshotRecord> newest_first;
  const auto known = snapshots_.find(session);
  if (known == snapshots_.end()) return newest_first;
  for (const auto& [sequence, snapshot] : known->second) newest_first.push_back(snapshot);
  std::reverse(newest_first.begin(), newest_first.end());
  return newest_first;
}

absl::Status MemoryStore::DropSnapshot(const std::string& session, uint64_t sequence) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = snapshots_.find(session);
  if (known != snapshots_.end()) known->second.erase(sequence);
  return absl::OkStatus();
}

absl::StatusOr<int> MemoryStore::BeginWork(const std::string& session, const std::string& work) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (logs_.find(session) == logs_.end()) {
    return absl::NotFoundError(absl::StrCat("no log of ", session));
  }
  return ++begun_[session][work];
}

absl::Status MemoryStore::EndWork(const std::string& session, const std::string& work) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = begun_.find(session);
  if (known != begun_.end()) known->second.erase(work);
  return absl::OkStatus();
}

absl::StatusOr<std::string> MemoryStore::PutBlob(absl::string_view bytes) {
  std::string sha256 = bytes::Sha256::Of(bytes);
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = blobs_.find(sha256);
  if (known != blobs_.end()) {
    ++known->second.holders;
    return sha256;
  }
  absl::Status room = Reserve(bytes.size());
  if (!room.ok()) return room;
  blobs_[sha256] = {std::string(bytes), 1};
  return sha256;
}

absl::Status MemoryStore::PutSpool(const std::string& spool, const std::string& sha256) {
  std::string whole;
  absl::Status read =
      ReadSpool(spool, [&whole](absl::string_view record) { return AppendPiece(record, whole); });
  if (!read.ok()) return read;
  const absl::StatusOr<std::string> put = PutBlob(whole);
  if (!put.ok() || *put == sha256) return put.status();
  ReleaseBlob(*put).IgnoreError();
  return absl::DataLossError("the pieces do not come to what their SHA-256 says");
}

absl::StatusOr<int64_t> MemoryStore::BlobSize(const std::string& sha256) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto blob = blobs_.find(sha256);
  if (blob == blobs_.end()) return absl::NotFoundError("no such blob");
  return static_cast<int64_t>(blob->second.bytes.size());
}

absl::StatusOr<std::string> MemoryStore::GetBlob(const std::string& sha256) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto blob = blobs_.find(sha256);
  if (blob == blobs_.end()) return absl::NotFoundError("no such blob");
  return blob->second.bytes;
}

absl::Status MemoryStore::ReleaseBlob(const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto blob = blobs_.find(sha256);
  if (blob == blobs_.end()) return absl::NotFoundError("no such blob");
  if (--blob->second.holders > 0) return absl::OkStatus();
  used_ -= blob->second.bytes.size();
  blobs_.erase(blob);
  return absl::OkStatus();
}

absl::Status MemoryStore::KeepBlobs(const std::map<std::string, int>& holders) {
  std::lock_guard<std::mutex> lock(mutex_);
  for (auto blob = blobs_.begin(); blob != blobs_.end();) {
    const auto held = holders.find(blob->first);
    if (held != holders.end()) {
      blob->second.holders = held->second;
      ++blob;
    } else {
      used_ -= blob->second.bytes.size();
      blob = blobs_.erase(blob);
    }
  }
  return absl::OkStatus();
}

absl::Status MemoryStore::KeepAllBlobs(const std::map<std::string, int>& holders) {
  std::lock_guard<std::mutex> lock(mutex_);
  for (auto& [sha256, blob] : blobs_) {
    const auto held = holders.find(sha256);
    blob.holders = 1 + (held == holders.end() ? 0 : held->second);
  }
  return absl::OkStatus();
}

absl::StatusOr<absl::Duration> MemoryStore::SeenTime() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return seen_;
}

absl::Status MemoryStore::PutSeenTime(absl::Duration seen) {
  std::lock_guard<std::mutex> lock(mutex_);
  seen_ = seen;
  return absl::OkStatus();
}

absl::Status MemoryStore::AppendSpool(const std::string& spool, absl::string_view record) {
  std::lock_guard<std::mutex> lock(mutex_);
  absl::Status room = Reserve(record.size());
  if (!room.ok()) return room;
  spools_[spool].emplace_back(record);
  return absl::OkStatus();
}

absl::Status MemoryStore::SyncSpool(const std::string&) { return absl::OkStatus(); }

absl::Status MemoryStore::CutSpool(const std::string& spool, size_t records) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = spools_.find(spool);
  if (known == spools_.end()) return absl::OkStatus();
  while (known->second.size() > records) {
    used_ -= known->second.back().size();
    known->second.pop_back();
  }
  return absl::OkStatus();
}

absl::Status MemoryStore::ReadSpool(
    const std::string& spool, absl::FunctionRef<absl::Status(absl::string_view)> visit) const {
  std::vector<std::string> records;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto it = spools_.find(spool);
    if (it != spools_.end()) records = it->second;
  }
  for (const std::string& record : records) {
    if (absl::Status visited = visit(record); !visited.ok()) return visited;
  }
  return absl::OkStatus();
}

absl::StatusOr<FileDescriptor> MemoryStore::OpenSpool(const std::string& spool) const {
  const FileDescriptor whole(::memfd_create("spool", MFD_CLOEXEC));
  if (!whole.ok()) return FileError("cannot make", spool);
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = spools_.find(spool);
  if (it == spools_.end()) return absl::NotFoundError("no such spool");
  uint64_t at = 0;
  for (const std::string& record : it->second) {
    std::string bytes;
    if (absl::Status piece = AppendPiece(record, bytes); !piece.ok()) return piece;
    if (absl::Status put = WriteAt(whole.get(), bytes, at, spool); !put.ok()) return put;
    at += bytes.size();
  }
  // The same file, for reading only.
  FileDescriptor reading(
      ::open(absl::StrCat("/proc/self/fd/", whole.get()).c_str(), O_RDONLY | O_CLOEXEC));
  if (!reading.ok()) return FileError("cannot open", spool);
  return reading;
}

absl::StatusOr<int64_t> MemoryStore::FreeBytes() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int64_t>(capacity_ - used_);
}

absl::Status MemoryStore::DropSpool(const std::string& spool) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = spools_.find(spool);
  if (it == spools_.end()) return absl::OkStatus();
  for (const std::string& record : it->second) used_ -= record.size();
  spools_.erase(it);
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> MemoryStore::Spools() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> names;
  names.reserve(spools_.size());
  for (const auto& [name, records] : spools_) names.push_back(name);
  return names;
}

size_t MemoryStore::used() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return used_;
}

}  // namespace vantage::store
