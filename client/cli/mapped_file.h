// A file's bytes without a copy of them: for files larger than a small machine's memory.
#ifndef VANTAGE_CLIENT_CLI_MAPPED_FILE_H_
#define VANTAGE_CLIENT_CLI_MAPPED_FILE_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::cli {

class MappedFile {
 public:
  // INVALID_ARGUMENT: it is empty, or no regular file; else what the system says.
  static absl::StatusOr<MappedFile> Open(const std::string& path);
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&&) = delete;
  ~MappedFile();

  // As long as the object lives, and nobody cuts the file off.
  absl::string_view bytes() const { return {bytes_, size_}; }

 private:
  MappedFile(const char* bytes, size_t size) : bytes_(bytes), size_(size) {}

  const char* bytes_;  // null: they have moved to another
  size_t size_;
};

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_MAPPED_FILE_H_
