#include "server/store/store_folder.h"

#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/store/durable_file.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kRestore = "restore";

// Has a line that says what is being copied, and from where.
std::string MarkIn(const std::string& folder) { return absl::StrCat(folder, "/unfinished"); }

std::string MarkOf(absl::string_view what, const std::string& from) {
  return absl::StrCat(what, " ", fs::absolute(from).lexically_normal().string(), "\n");
}

bool HasFiles(const std::string& folder) {
  std::error_code error;
  for (fs::recursive_directory_iterator file(folder, error), end; file != end && !error;
       file.increment(error)) {
    if (file->is_regular_file(error)) return true;
  }
  return false;
}

}  // namespace

std::string DatabaseIn(const std::string& folder) { return absl::StrCat(folder, "/logs.sqlite"); }
std::string BlobsIn(const std::string& folder) { return absl::StrCat(folder, "/blobs"); }
std::string SpoolsIn(const std::string& folder) { return absl::StrCat(folder, "/spools"); }

absl::Status CheckNewFolder(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) || fs::is_empty(folder, error)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(folder, " is not empty: name a folder that is, or that does not exist"));
}

absl::Status CheckNotWithoutLogs(const std::string& folder) {
  std::error_code error;
  const uintmax_t size = fs::file_size(DatabaseIn(folder), error);
  const bool logs = !error && size > 0;
  if (logs || (!HasFiles(BlobsIn(folder)) && !HasFiles(SpoolsIn(folder)))) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      folder, " has scans (in blobs and spools) without the logs that say whose they are: ",
      DatabaseIn(folder),
      " is missing or empty. Put it back, or restore a backup to a new folder ('vantaged restore "
      "BACKUP --data NEW'). To begin anew without these scans, move blobs and spools elsewhere"));
}

absl::Status BeginCopy(const std::string& to, absl::string_view what, const std::string& from) {
  if (absl::Status made = MakeFolder(to); !made.ok()) return made;
  return ReplaceFile(MarkIn(to), MarkIn(to) + ".new", MarkOf(what, from));
}

absl::Status EndCopy(const std::string& to) {
  if (::unlink(MarkIn(to).c_str()) != 0) return FileError("cannot remove", MarkIn(to));
  return SyncFolder(to);
}

bool IsCopyOf(const std::string& to, absl::string_view what, const std::string& from) {
  const absl::StatusOr<std::string> mark = ReadWhole(MarkIn(to));
  return mark.ok() && *mark == MarkOf(what, from);
}

absl::Status CheckFinished(const std::string& folder) {
  const absl::StatusOr<std::string> mark = ReadWhole(MarkIn(folder));
  if (absl::IsNotFound(mark.status())) return absl::OkStatus();
  if (!mark.ok()) return mark.status();
  const absl::string_view copy = absl::StripSuffix(*mark, "\n");
  if (absl::StartsWith(copy, kRestore)) {
    return absl::FailedPreconditionError(
        absl::StrCat("a restore to ", folder, " was broken off: finish it with 'vantaged ", copy,
                     " --data ", folder, "', or empty the folder"));
  }
  return absl::FailedPreconditionError(absl::StrCat(folder, " is a copy that was broken off (",
                                                    copy, "): remove it, and make another"));
}

}  // namespace vantage::store
