// Reads and writes whole files.
#ifndef VANTAGE_CLIENT_CLI_FILE_H_
#define VANTAGE_CLIENT_CLI_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::cli {

// NOT_FOUND, PERMISSION_DENIED, ... as the file system says; names the path.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// Writes a temporary file beside the path and renames it, so that no incomplete file ever has the
// name.
class AtomicFile {
 public:
  explicit AtomicFile(std::string path);
  ~AtomicFile();  // without Commit() no file is left
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  absl::Status Append(absl::string_view bytes);
  absl::Status Commit();

 private:
  absl::Status Open();

  std::string path_;
  std::string partial_;
  int descriptor_ = -1;
};

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_FILE_H_
