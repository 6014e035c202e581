// Files that are there after a power cut: what every promise of the disk store comes down to.
#ifndef VANTAGE_SERVER_STORE_DURABLE_FILE_H_
#define VANTAGE_SERVER_STORE_DURABLE_FILE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::store {

// A file descriptor that closes itself.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;

  int get() const { return fd_; }
  bool ok() const { return fd_ >= 0; }

 private:
  int fd_;
};

// `doing` failed with errno: RESOURCE_EXHAUSTED when there is no room, NOT_FOUND, else UNAVAILABLE.
absl::Status FileError(absl::string_view doing, const std::string& path);

// The folder, its parents made where missing, readable by its owner only. Durable.
absl::Status MakeFolder(const std::string& path);

// What happened to the names in a folder is on the medium.
absl::Status SyncFolder(const std::string& path);

// All of `bytes` at `offset`.
absl::Status WriteAt(int fd, absl::string_view bytes, uint64_t offset, const std::string& path);
absl::Status SyncData(int fd, const std::string& path);

// The whole file. NOT_FOUND.
absl::StatusOr<std::string> ReadWhole(const std::string& path);

// `path` holds `bytes`, or what it held before, whatever happens meanwhile. `temporary` is in the
// same file system and nobody else's; it is gone afterwards.
absl::Status ReplaceFile(const std::string& path, const std::string& temporary,
                         absl::string_view bytes);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_DURABLE_FILE_H_
