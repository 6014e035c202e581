// Bytes at any place of something large: of a file, without all of it in memory, or of memory.
#ifndef VANTAGE_CORE_BYTES_BYTE_SOURCE_H_
#define VANTAGE_CORE_BYTES_BYTE_SOURCE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

// Copies read the same. Not thread safe.
class ByteSource {
 public:
  // Of memory that outlives it; implicitly, so that functions take either.
  ByteSource(absl::string_view bytes) : bytes_(bytes), size_(bytes.size()) {}     // NOLINT
  ByteSource(const std::string& bytes) : ByteSource(absl::string_view(bytes)) {}  // NOLINT
  // Of a regular file, which stays open. Errors as the file system says.
  static absl::StatusOr<ByteSource> Open(const std::string& path);
  // Of a regular file of `size` bytes that is open already, and becomes this source's. `path` names
  // it in errors; the file system is not asked again.
  static ByteSource Adopt(int descriptor, uint64_t size, const std::string& path);

  // Of the file, which stays this source's; -1 for memory.
  int descriptor() const;

  // From now on calls `reached(position)` whenever a piece of the file was read, with the place in
  // the whole file up to which; of copies, too. Nothing is called for memory.
  void Watch(std::function<void(uint64_t)> reached);

  uint64_t size() const { return size_; }
  // `size` bytes from `begin` on, which must lie within size(), as a source.
  ByteSource Part(uint64_t begin, uint64_t size) const;
  // A view of `size` bytes from `begin` on, which must lie within size(); valid until the next call
  // on this source or a copy of it. DATA_LOSS: the file has become shorter, or cannot be read.
  absl::StatusOr<absl::string_view> View(uint64_t begin, size_t size);
  // All of it. DATA_LOSS as of View().
  absl::StatusOr<std::string> All() const;

 private:
  struct OpenFile;

  ByteSource(std::shared_ptr<OpenFile> file, uint64_t size) : size_(size), file_(std::move(file)) {}

  absl::string_view bytes_;  // where there is no file
  uint64_t begin_ = 0;       // within the file
  uint64_t size_ = 0;
  std::shared_ptr<OpenFile> file_;
};

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_BYTE_SOURCE_H_
