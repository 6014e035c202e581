#include "core/bytes/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::bytes {
namespace {

// What is read at a time: far more than a call to the system costs, and little beside a scan.
constexpr size_t kWindow = 4 << 20;  // bytes

}  // namespace

struct ByteSource::OpenFile {
  OpenFile(int opened, std::string name) : descriptor(opened), path(std::move(name)) {}
  ~OpenFile() { close(descriptor); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  absl::Status Read(uint64_t begin, char* out, size_t size) const;

  const int descriptor;
  const std::string path;
  std::string window;
  uint64_t window_begin = 0;
  std::function<void(uint64_t)> reached;
};

absl::StatusOr<ByteSource> ByteSource::Open(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return absl::ErrnoToStatus(errno, absl::StrCat(path, ": cannot open"));
  auto file = std::make_shared<OpenFile>(descriptor, path);
  struct stat found {};
  if (fstat(descriptor, &found) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat(path, ": cannot read"));
  }
  if (!S_ISREG(found.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a regular file"));
  }
  return ByteSource(std::move(file), static_cast<uint64_t>(found.st_size));
}

ByteSource ByteSource::Adopt(int descriptor, uint64_t size, const std::string& path) {
  return ByteSource(std::make_shared<OpenFile>(descriptor, path), size);
}

int ByteSource::descriptor() const { return file_ == nullptr ? -1 : file_->descriptor; }

absl::Status ByteSource::OpenFile::Read(uint64_t begin, char* out, size_t size) const {
  size_t have = 0;
  while (have < size) {
    const ssize_t count =
        pread(descriptor, out + have, size - have, static_cast<off_t>(begin + have));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return absl::DataLossError(absl::StrCat(path, ": reading failed at byte ", begin + have));
    }
    have += static_cast<size_t>(count);
  }
  if (reached) reached(begin + size);
  return absl::OkStatus();
}

void ByteSource::Watch(std::function<void(uint64_t)> reached) {
  if (file_ != nullptr) file_->reached = std::move(reached);
}

ByteSource ByteSource::Part(uint64_t begin, uint64_t size) const {
  ByteSource part = *this;
  part.size_ = size;
  part.begin_ += begin;
  if (file_ == nullptr) {
    part.bytes_ = bytes_.substr(static_cast<size_t>(begin), static_cast<size_t>(size));
  }
  return part;
}

absl::StatusOr<absl::string_view> ByteSource::View(uint64_t begin, size_t size) {
  if (file_ == nullptr) return bytes_.substr(static_cast<size_t>(begin), size);
  const uint64_t left = size_ - begin;
  begin += begin_;
  std::string& window = file_->window;
  const bool held =
      begin >= file_->window_begin && begin + size <= file_->window_begin + window.size();
  if (!held) {
    window.resize(static_cast<size_t>(std::min<uint64_t>(std::max(size, kWindow), left)));
    file_->window_begin = begin;
    if (absl::Status read = file_->Read(begin, window.data(), window.size()); !read.ok()) {
      window.clear();
      return read;
    }
  }
  return absl::string_view(window).substr(static_cast<size_t>(begin - file_->window_begin), size);
}

absl::StatusOr<std::string> ByteSource::All() const {
  if (file_ == nullptr) return std::string(bytes_);
  std::string all(static_cast<size_t>(size_), '\0');
  if (absl::Status read = file_->Read(begin_, all.data(), all.size()); !read.ok()) return read;
  return all;
}

}  // namespace vantage::bytes
