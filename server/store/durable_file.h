// Files that survive a power cut. Every promise of the disk store rests on them.
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

// Makes the folder and its missing parents, readable by its owner only. Durable.
absl::Status MakeFolder(const std::string& path);

// Syncs the names in a folder to the medium.
absl::Status SyncFolder(const std::string& path);

// Writes all of `bytes` at `offset`.
absl::Status WriteAt(int fd, absl::string_view bytes, uint64_t offset, const std::string& path);
absl::Status SyncData(int fd, const std::string& path);

// Reads the whole file. NOT_FOUND.
absl::StatusOr<std::string> ReadWhole(const std::string& path);

// Replaces the contents of `path`: after a crash it holds `bytes` or what it held before.
// `temporary` is in the same file system and used by nobody else; it is removed.
absl::Status ReplaceFile(const std::string& path, const std::string& temporary,
                         absl::string_view bytes);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_DURABLE_FILE_H_
