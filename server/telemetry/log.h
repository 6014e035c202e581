// Structured logs: one JSON object a line.
#ifndef VANTAGE_SERVER_TELEMETRY_LOG_H_
#define VANTAGE_SERVER_TELEMETRY_LOG_H_

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "server/telemetry/log_writer.h"

namespace vantage::telemetry {

// An audit is written at every level but off.
enum class LogLevel { kDebug = 0, kInfo = 1, kWarning = 2, kError = 3, kAudit = 4, kOff = 5 };

// A named value of a line. Numbers stay numbers.
class LogField {
 public:
  LogField() = default;  // none: the line goes without
  LogField(absl::string_view key, absl::string_view value);
  LogField(absl::string_view key, const char* value) : LogField(key, absl::string_view(value)) {}
  LogField(absl::string_view key, const std::string& value)
      : LogField(key, absl::string_view(value)) {}
  LogField(absl::string_view key, int64_t value);
  LogField(absl::string_view key, uint64_t value);
  LogField(absl::string_view key, int value) : LogField(key, static_cast<int64_t>(value)) {}
  LogField(absl::string_view key, double value);  // null where not finite
  LogField(absl::string_view key, bool value);

  const std::string& json() const { return json_; }  // "key":value

 private:
  std::string json_;
};

// Thread safe.
class Log {
 public:
  using Sink = std::function<void(absl::string_view line)>;  // a line without its end

  // `sink` should not block: whoever works waits for it.
  Log(LogLevel level, Sink sink);
  // `writer` outlives this object.
  Log(LogLevel level, LogWriter& writer);
  // Writes nothing.
  static Log Silent() {
    return Log(LogLevel::kOff, [](absl::string_view) {});
  }

  void Debug(absl::string_view message, std::initializer_list<LogField> fields = {}) {
    Write(LogLevel::kDebug, message, fields);
  }
  void Info(absl::string_view message, std::initializer_list<LogField> fields = {}) {
    Write(LogLevel::kInfo, message, fields);
  }
  void Warning(absl::string_view message, std::initializer_list<LogField> fields = {}) {
    Write(LogLevel::kWarning, message, fields);
  }
  void Error(absl::string_view message, std::initializer_list<LogField> fields = {}) {
    Write(LogLevel::kError, message, fields);
  }
  // A change that somebody made or tried to make.
  void Audit(std::initializer_list<LogField> fields) { Write(LogLevel::kAudit, "audit", fields); }
  bool Enabled(LogLevel level) const { return level >= level_; }
  // Lines that nobody took in time.
  int64_t lost() const { return writer_ == nullptr ? 0 : writer_->lost(); }

  void Write(LogLevel level, absl::string_view message, std::initializer_list<LogField> fields);

 private:
  const LogLevel level_;
  const LogWriter* const writer_ = nullptr;
  std::mutex mutex_;
  const Sink sink_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_LOG_H_
