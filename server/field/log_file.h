// A log in a file that does not grow for ever.
#ifndef VANTAGE_SERVER_FIELD_LOG_FILE_H_
#define VANTAGE_SERVER_FIELD_LOG_FILE_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/durable_file.h"

namespace vantage::field {

class LogFile {
 public:
  // Of a site's log that is some months: an audit line has 0.3 KB, a day's work some thousand.
  static constexpr int64_t kMost = int64_t{32} << 20;

  // Goes on with the file that is there; for its owner alone. As of FileError (durable_file.h).
  static absl::StatusOr<std::unique_ptr<LogFile>> Open(const std::string& path,
                                                       int64_t most = kMost);

  // To append to; the number stays the same.
  int descriptor() const { return file_.get(); }
  const std::string& path() const { return path_; }

  // When it has grown to `most`: it becomes PATH.1, in place of the one before, and an empty one
  // takes its place.
  absl::Status TurnOver();

 private:
  LogFile(std::string path, int64_t most, store::FileDescriptor file)
      : path_(std::move(path)), most_(most), file_(std::move(file)) {}

  const std::string path_;
  const int64_t most_;
  const store::FileDescriptor file_;
};

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_LOG_FILE_H_
