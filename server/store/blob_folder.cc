#include "server/store/blob_folder.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "proto/wire/checksum.h"
#include "server/store/durable_file.h"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinished[] = "unfinished";
constexpr size_t kNameSize = 64;

}  // namespace

std::string BlobFolder::FileOf(const std::string& sha256) const {
  const std::string name = absl::BytesToHexString(sha256);
  return absl::StrCat(path_, "/", name.substr(0, 2), "/", name);
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
    const std::string name = file->path().filename().string();
    const bool named =
        name.size() == kNameSize && std::all_of(name.begin(), name.end(), absl::ascii_isxdigit);
    if (named) there.push_back(absl::HexStringToBytes(name));
  }
  if (error) {
    return absl::UnavailableError(absl::StrCat("cannot list ", path_, ": ", error.message()));
  }
  std::sort(there.begin(), there.end());
  return there;
}

absl::StatusOr<std::string> BlobFolder::Put(absl::string_view bytes) {
  std::string sha256 = Sha256::Of(bytes);
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = holders_.find(sha256);
  if (known != holders_.end()) {
    ++known->second;
    return sha256;
  }
  const std::string file = FileOf(sha256);
  absl::Status written = MakeFolder(fs::path(file).parent_path().string());
  if (written.ok()) written = ReplaceFile(file, absl::StrCat(path_, "/", kUnfinished), bytes);
  if (!written.ok()) return written;
  holders_[sha256] = 1;
  return sha256;
}

absl::StatusOr<int64_t> BlobFolder::Size(const std::string& sha256) const {
  std::error_code error;
  const uintmax_t size = fs::file_size(FileOf(sha256), error);
  if (error == std::errc::no_such_file_or_directory) return absl::NotFoundError("no such blob");
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot read ", FileOf(sha256), ": ", error.message()));
  }
  return static_cast<int64_t>(size);
}

absl::StatusOr<std::string> BlobFolder::Get(const std::string& sha256) const {
  absl::StatusOr<std::string> bytes = ReadWhole(FileOf(sha256));
  if (absl::IsNotFound(bytes.status())) return absl::NotFoundError("no such blob");
  if (bytes.ok() && Sha256::Of(*bytes) != sha256) {
    return absl::DataLossError(
        absl::StrCat(FileOf(sha256), " is damaged: its SHA-256 is not its name; restore it"));
  }
  return bytes;
}

absl::Status BlobFolder::Release(const std::string& sha256) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = holders_.find(sha256);
  if (known == holders_.end()) return absl::NotFoundError("no such blob");
  if (--known->second > 0) return absl::OkStatus();
  holders_.erase(known);
  if (::unlink(FileOf(sha256).c_str()) != 0) {
    absl::Status error = FileError("cannot remove", FileOf(sha256));
    if (!absl::IsNotFound(error)) return error;
  }
  return absl::OkStatus();
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
    } else if (::unlink(FileOf(sha256).c_str()) != 0) {
      return FileError("cannot remove", FileOf(sha256));
    }
  }
  return absl::OkStatus();
}

}  // namespace vantage
