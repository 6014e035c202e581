#include "server/store/spool_folder.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "server/store/durable_file.h"
#include "server/store/piece_record.h"
#include "server/store/record_file.h"

namespace vantage::store {
namespace {

// How files begin that hold a whole upload's bytes, for the moment in which they have a name.
constexpr char kWhole[] = "whole-";

}  // namespace

// Names are of lower-case letters, digits, '-' and '/'.
std::string SpoolFolder::FileOf(const std::string& spool) const {
  return absl::StrCat(path_, "/", absl::StrReplaceAll(spool, {{"/", "."}}));
}

absl::Status SpoolFolder::Open() { return MakeFolder(path_); }

std::shared_ptr<SpoolFolder::Spool> SpoolFolder::Find(const std::string& spool) {
  std::lock_guard<std::mutex> lock(mutex_);
  std::shared_ptr<Spool>& known = open_[spool];
  if (known == nullptr) known = std::make_shared<Spool>();
  return known;
}

absl::Status SpoolFolder::Append(const std::string& spool, absl::string_view record) {
  const std::shared_ptr<Spool> open = Find(spool);
  std::lock_guard<std::mutex> lock(open->mutex);
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!file.ok()) return FileError("cannot open", path);
  if (open->size == kUnknown) {
    const absl::StatusOr<int64_t> whole =
        VisitRecords(file.get(), path, [](absl::string_view) { return absl::OkStatus(); });
    if (!whole.ok()) return whole.status();
    open->size = *whole;
    open->tail = true;
  }
  const RecordHeader header = RecordHeader::Of(record);
  const auto at = static_cast<uint64_t>(open->size);
  // Truncates the file, so that old records never follow a new one.
  absl::Status status;
  if (open->tail && ::ftruncate(file.get(), open->size) != 0) {
    status = FileError("cannot write", path);
  }
  if (status.ok()) {
    open->tail = false;
    status = WriteAt(file.get(), header.bytes(), at, path);
  }
  if (status.ok()) status = WriteAt(file.get(), record, at + sizeof(header), path);
  if (!status.ok()) {
    // Frees the space on disk. Where that fails, the size in memory still counts.
    open->tail = true;
    std::ignore = ::ftruncate(file.get(), open->size);
    return status;
  }
  open->size += static_cast<int64_t>(sizeof(header) + record.size());
  return absl::OkStatus();
}

// Others may append meanwhile.
absl::Status SpoolFolder::Sync(const std::string& spool) {
  const std::shared_ptr<Spool> open = Find(spool);
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.ok()) return FileError("cannot open", path);
  if (absl::Status synced = SyncData(file.get(), path); !synced.ok()) return synced;
  {
    std::lock_guard<std::mutex> lock(open->mutex);
    if (open->named) return absl::OkStatus();
  }
  absl::Status synced = SyncFolder(path_);
  std::lock_guard<std::mutex> lock(open->mutex);
  open->named = open->named || synced.ok();
  return synced;
}

absl::Status SpoolFolder::Cut(const std::string& spool, size_t records) {
  const std::shared_ptr<Spool> open = Find(spool);
  std::lock_guard<std::mutex> lock(open->mutex);
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.ok()) return errno == ENOENT ? absl::OkStatus() : FileError("cannot open", path);
  int64_t size = 0;
  size_t seen = 0;
  const absl::StatusOr<int64_t> whole =
      VisitRecords(file.get(), path, [&](absl::string_view record) {
        if (seen++ < records) size += static_cast<int64_t>(sizeof(RecordHeader) + record.size());
        return absl::OkStatus();
      });
  if (!whole.ok()) return whole.status();
  if (::ftruncate(file.get(), size) != 0) return FileError("cannot write", path);
  open->size = size;
  return absl::OkStatus();
}

absl::Status SpoolFolder::Read(const std::string& spool,
                               absl::FunctionRef<absl::Status(absl::string_view)> visit) const {
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) {
    return errno == ENOENT ? absl::OkStatus() : FileError("cannot open", path);
  }
  return VisitRecords(file.get(), path, visit).status();
}

absl::StatusOr<FileDescriptor> SpoolFolder::OpenBytes(const std::string& spool) const {
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) return FileError("cannot open", path);
  // What a crash leaves of it in between is no spool of any upload, and goes at the next start.
  std::string named = absl::StrCat(path_, "/", kWhole, "XXXXXX");
  const FileDescriptor whole(::mkostemp(named.data(), O_CLOEXEC));
  if (!whole.ok()) return FileError("cannot make", named);
  FileDescriptor reading(::open(named.c_str(), O_RDONLY | O_CLOEXEC));
  const absl::Status opened = reading.ok() ? absl::OkStatus() : FileError("cannot open", named);
  ::unlink(named.c_str());
  if (!opened.ok()) return opened;
  uint64_t at = 0;
  const absl::StatusOr<int64_t> read =
      VisitRecords(file.get(), path, [&](absl::string_view record) -> absl::Status {
        std::string bytes;
        if (absl::Status piece = AppendPiece(record, bytes); !piece.ok()) return piece;
        const uint64_t begin = at;
        at += bytes.size();
        return WriteAt(whole.get(), bytes, begin, named);
      });
  if (!read.ok()) return read.status();
  return reading;
}

absl::StatusOr<int64_t> SpoolFolder::FreeBytes() const {
  struct statvfs about {};
  if (::statvfs(path_.c_str(), &about) != 0) return FileError("cannot ask for the room at", path_);
  const auto free = static_cast<uint64_t>(about.f_bavail) * static_cast<uint64_t>(about.f_frsize);
  return static_cast<int64_t>(std::min<uint64_t>(free, std::numeric_limits<int64_t>::max()));
}

absl::Status SpoolFolder::Check(const std::string& spool) const {
  const std::string path = FileOf(spool);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) {
    return errno == ENOENT ? absl::OkStatus() : FileError("cannot open", path);
  }
  bool damaged = false;
  const absl::StatusOr<int64_t> whole = VisitRecords(
      file.get(), path, [](absl::string_view) { return absl::OkStatus(); }, &damaged);
  if (!whole.ok() || !damaged) return whole.status();
  return absl::DataLossError(
      absl::StrCat(path, " is damaged at byte ", *whole, "; its sender is asked for the rest"));
}

absl::Status SpoolFolder::Drop(const std::string& spool) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    open_.erase(spool);
  }
  const std::string path = FileOf(spool);
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return FileError("cannot remove", path);
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> SpoolFolder::List() const {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator file(path_, error), end; file != end && !error;
       file.increment(error)) {
    names.push_back(absl::StrReplaceAll(file->path().filename().string(), {{".", "/"}}));
  }
  if (error) {
    return absl::UnavailableError(absl::StrCat("cannot list ", path_, ": ", error.message()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace vantage::store
