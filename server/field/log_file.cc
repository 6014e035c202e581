#include "server/field/log_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace vantage::field {
namespace {

store::FileDescriptor OpenToAppend(const std::string& path) {
  return store::FileDescriptor(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
}

}  // namespace

absl::StatusOr<std::unique_ptr<LogFile>> LogFile::Open(const std::string& path, int64_t most) {
  store::FileDescriptor file = OpenToAppend(path);
  if (!file.ok()) return store::FileError("cannot write the log", path);
  return std::unique_ptr<LogFile>(new LogFile(path, most, std::move(file)));
}

absl::Status LogFile::TurnOver() {
  struct stat about {};
  if (fstat(file_.get(), &about) != 0) return store::FileError("cannot look at", path_);
  if (about.st_size < most_) return absl::OkStatus();
  const std::string before = path_ + ".1";
  if (std::rename(path_.c_str(), before.c_str()) != 0) {
    return store::FileError("cannot rename to", before);
  }
  const store::FileDescriptor next = OpenToAppend(path_);
  if (!next.ok()) return store::FileError("cannot write the log", path_);
  // In one step, whoever writes meanwhile.
  if (::dup3(next.get(), file_.get(), O_CLOEXEC) < 0) {
    return store::FileError("cannot turn over", path_);
  }
  return absl::OkStatus();
}

}  // namespace vantage::field
