// Writes lines from a thread of its own, so that whoever reads them can stall or die and no work
// waits for it.
#ifndef VANTAGE_SERVER_TELEMETRY_LOG_WRITER_H_
#define VANTAGE_SERVER_TELEMETRY_LOG_WRITER_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/strings/string_view.h"

namespace vantage::telemetry {

// Thread safe. The process has to ignore SIGPIPE.
class LogWriter {
 public:
  // What may wait to be written, bytes: some twenty thousand lines, hours of a quiet server and
  // seconds of a busy one.
  static constexpr size_t kMostWaiting = size_t{4} << 20;
  // How long the end of a process waits for what is still to be written.
  static constexpr std::chrono::milliseconds kPatience{500};

  // `file` is a descriptor (a file, a pipe, a socket or a terminal) that stays open.
  explicit LogWriter(int file, size_t most_waiting = kMostWaiting);
  // Waits for `kPatience` at most; a thread that its descriptor still holds is left behind.
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  // Returns at once. `line` is without its end. One for which there is no room, or nobody to read
  // it, is lost, and before the next that is written a line says how many were.
  void Write(absl::string_view line);

  // Lines that were lost.
  int64_t lost() const;

 private:
  struct Shared;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_LOG_WRITER_H_
