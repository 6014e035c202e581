#include "server/store/blob_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/bytes/checksum.h"
#include "server/store/durable_file.h"
#include "server/store/piece_record.h"
#include "server/store/record_file.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinished[] = "unfinished";
constexpr char kRecords[] = ".pieces";
constexpr size_t kNameSize = 64;

// The bytes that the records of a file make.
absl::StatusOr<std::string> ReadPieces(const std::string& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) return FileError("cannot open", path);
  std::string whole;
  const absl::StatusOr<int64_t> read = VisitRecords(
      file.get(), path, [&whole](absl::string_view record) { return AppendPiece(record, whole); });
  if (absl::IsDataLoss(read.status())) {
    return absl::DataLossError(
        absl::StrCat(path, " is damaged: ", read.status().message(), "; restore it"));
  }
  if (!read.ok()) return read.status();
  return whole;
}

}  // namespace

std::string BlobFolder::FileOf(const std::string& sha256, bool records) const {
  const std::string name = absl::BytesToHexString(sha256);
  return absl::StrCat(path_, "/", name.substr(0, 2), "/", name, records ? kRecords : "");
}

absl::Status BlobFolder::Open() {
  if (absl::Status made = MakeFolder(path_); !made.ok()) return made;
  ::unlink(absl::StrCat(path_, "/", kUnfinished).c_str());
  const absl::StatusOr<std::vector<std::string>> there = List();
  if (!there.ok()) return there.status();
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& sha256 : *there) holders_[sha256] = 1;
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> BlobFolder::List() const {
  std::vector<std::string> there;
  std::error_code error;
  for (fs::recursive_directory_iterator file(path_, error), end; file != end && !error;
       file.increment(error)) {
    const std::string name(absl::StripSuffix(file->path().filename().string(), kRecords));
    const bool named =
        name.size() == kNameSize && std::all_of(name.begin(), name.end(), absl::ascii_isxdigit);
    if (named) there.push_back(absl::HexStringToBytes(name));
  }
  if (error) {
    return absl::UnavailableError(absl::StrCat("cannot list ", path_, ": ", error.message()));
  }
  std::sort(there.begin(), there.end());
  there.erase(std::unique(there.begin(), there.end()), there.end());
  return there;
}

absl::StatusOr<std::string> BlobFolder::Put(absl::string_view bytes) {
  std::string sha256 = bytes::Sha256::Of(bytes);
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = holders_.find(sha256);
  if (known != holders_.end()) {
    ++known->second;
    return sha256;
  }
  const std::string file = FileOf(sha256, false);
  absl::Status written = MakeFolder(fs::path(file).parent_path().string());
  if (written.ok()) written = ReplaceFile(file, absl::StrCat(path_, "/", kUnfinished), bytes);
  if (!written.ok()) return written;
  holders_[sha256] = 1;
  return sha256;
}

absl::Status BlobFolder::PutRecords(const std::string& records, const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = holders_.find(sha256);
  if (known != holders_.end()) {
    ++known->second;
    return absl::OkStatus();
  }
  const std::string file = FileOf(sha256, true);
  const std::string folder = fs::path(file).parent_path().string();
  if (absl::Status made = MakeFolder(folder); !made.ok()) return made;
  // A file that may be there already is held by nobody.
  ::unlink(file.c_str());
  absl::Status kept;
  if (::link(records.c_str(), file.c_str()) == 0) {
    kept = SyncFolder(folder);
  } else {
    // The file system has no hard links.
    const absl::StatusOr<std::string> bytes = ReadWhole(records);
    kept = bytes.ok() ? ReplaceFile(file, absl::StrCat(path_, "/", kUnfinished), *bytes)
                      : bytes.status();
  }
  if (kept.ok()) holders_[sha256] = 1;
  return kept;
}

absl::StatusOr<int64_t> BlobFolder::Size(const std::string& sha256) const {
  for (const bool records : {true, false}) {
    std::error_code error;
    const uintmax_t size = fs::file_size(FileOf(sha256, records), error);
    if (!error) return static_cast<int64_t>(size);
    if (error != std::errc::no_such_file_or_directory) {
      return absl::UnavailableError(
          absl::StrCat("cannot read ", FileOf(sha256, records), ": ", error.message()));
    }
  }
  return absl::NotFoundError("no such blob");
}

absl::StatusOr<std::string> BlobFolder::Get(const std::string& sha256) const {
  const bool records = ::access(FileOf(sha256, true).c_str(), F_OK) == 0;
  const std::string file = FileOf(sha256, records);
  absl::StatusOr<std::string> bytes = records ? ReadPieces(file) : ReadWhole(file);
  if (absl::IsNotFound(bytes.status())) return absl::NotFoundError("no such blob");
  if (bytes.ok() && bytes::Sha256::Of(*bytes) != sha256) {
    return absl::DataLossError(
        absl::StrCat(file, " is damaged: its SHA-256 is not its name; restore it"));
  }
  return bytes;
}

absl::Status BlobFolder::Unlink(const std::string& sha256) const {
  for (const bool records : {true, false}) {
    const std::string file = FileOf(sha256, records);
    if (::unlink(file.c_str()) != 0 && errno != ENOENT) return FileError("cannot remove", file);
  }
  return absl::OkStatus();
}

absl::Status BlobFolder::Release(const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = holders_.find(sha256);
  if (known == holders_.end()) return absl::NotFoundError("no such blob");
  if (--known->second > 0) return absl::OkStatus();
  holders_.erase(known);
  return Unlink(sha256);
}

absl::Status BlobFolder::Keep(const std::map<std::string, int>& holders) {
  const absl::StatusOr<std::vector<std::string>> there = List();
  if (!there.ok()) return there.status();
  std::lock_guard<std::mutex> lock(mutex_);
  holders_.clear();
  for (const std::string& sha256 : *there) {
    const auto held = holders.find(sha256);
    if (held != holders.end()) {
      holders_[sha256] = held->second;
    } else if (absl::Status gone = Unlink(sha256); !gone.ok()) {
      return gone;
    }
  }
  return absl::OkStatus();
}

absl::Status BlobFolder::KeepAll(const std::map<std::string, int>& holders) {
  const absl::StatusOr<std::vector<std::string>> there = List();
  if (!there.ok()) return there.status();
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& sha256 : *there) {
    const auto held = holders.find(sha256);
    holders_[sha256] = 1 + (held == holders.end() ? 0 : held->second);
  }
  return absl::OkStatus();
}

}  // namespace vantage::store
