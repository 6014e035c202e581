#include "client/cli/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "absl/strings/str_cat.h"

namespace vantage::cli {
namespace {

absl::Status Failure(const char* verb, const std::string& path) {
  return absl::ErrnoToStatus(errno, absl::StrCat("cannot ", verb, " ", path));
}

}  // namespace

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Failure("open", path);
  std::string contents;
  char buffer[1 << 16];
  ssize_t got = 0;
  while ((got = read(descriptor, buffer, sizeof(buffer))) > 0) {
    contents.append(buffer, static_cast<size_t>(got));
  }
  const absl::Status status = got < 0 ? Failure("read", path) : absl::OkStatus();
  close(descriptor);
  if (!status.ok()) return status;
  return contents;
}

AtomicFile::AtomicFile(std::string path)
    : path_(std::move(path)), partial_(absl::StrCat(path_, ".part", getpid())) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  close(descriptor_);
  unlink(partial_.c_str());
}

absl::Status AtomicFile::Open() {
  if (descriptor_ >= 0) return absl::OkStatus();
  descriptor_ = open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  return descriptor_ < 0 ? Failure("write", path_) : absl::OkStatus();
}

absl::Status AtomicFile::Append(absl::string_view bytes) {
  if (absl::Status opened = Open(); !opened.ok()) return opened;
  while (!bytes.empty()) {
    const ssize_t put = write(descriptor_, bytes.data(), bytes.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return Failure("write", path_);
    bytes.remove_prefix(static_cast<size_t>(put));
  }
  return absl::OkStatus();
}

absl::Status AtomicFile::Commit() {
  if (absl::Status opened = Open(); !opened.ok()) return opened;
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (close(descriptor) != 0 || std::rename(partial_.c_str(), path_.c_str()) != 0) {
    absl::Status failure = Failure("write", path_);
    unlink(partial_.c_str());
    return failure;
  }
  return absl::OkStatus();
}

}  // namespace vantage::cli
