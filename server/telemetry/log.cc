#include "server/telemetry/log.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/telemetry/log_context.h"

namespace vantage::telemetry {
namespace {

// A JSON string. Bytes that are not printable ASCII are escaped, so a line stays a line whatever
// a client sends.
std::string Quoted(absl::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte == 0x7F) {
      absl::StrAppendFormat(&out, "\\u%04x", byte);
    } else {
      out += c;
    }
  }
  out += '"';
  return out;
}

const char* Name(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return "debug";
    case LogLevel::kInfo:
      return "info";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kAudit:
      return "audit";
    default:
      return "error";
  }
}

}  // namespace

LogField::LogField(absl::string_view key, absl::string_view value)
    : json_(absl::StrCat(Quoted(key), ":", Quoted(value))) {}
LogField::LogField(absl::string_view key, int64_t value)
    : json_(absl::StrCat(Quoted(key), ":", value)) {}
LogField::LogField(absl::string_view key, uint64_t value)
    : json_(absl::StrCat(Quoted(key), ":", value)) {}
LogField::LogField(absl::string_view key, double value)
    : json_(std::isfinite(value) ? absl::StrFormat("%s:%.9g", Quoted(key), value)
                                 : absl::StrCat(Quoted(key), ":null")) {}
LogField::LogField(absl::string_view key, bool value)
    : json_(absl::StrCat(Quoted(key), ":", value ? "true" : "false")) {}

Log::Log(LogLevel level, Sink sink) : level_(level), sink_(std::move(sink)) {}
Log::Log(LogLevel level, LogWriter& writer)
    : level_(level),
      writer_(&writer),
      sink_([&writer](absl::string_view line) { writer.Write(line); }) {}

void Log::Write(LogLevel level, absl::string_view message, std::initializer_list<LogField> fields) {
  if (!Enabled(level)) return;
  std::string line =
      absl::StrFormat(R"({"time":"%s","level":"%s","message":%s)",
                      absl::FormatTime("%Y-%m-%dT%H:%M:%E6SZ", absl::Now(), absl::UTCTimeZone()),
                      Name(level), Quoted(message));
  for (const LogField& field : fields) {
    if (!field.json().empty()) absl::StrAppend(&line, ",", field.json());
  }
  if (const LogContext trace = CurrentLogContext(); trace != nullptr) {
    absl::StrAppend(&line, ",\"trace_id\":", Quoted(*trace));
  }
  line += '}';
  std::lock_guard<std::mutex> lock(mutex_);
  sink_(line);
}

}  // namespace vantage::telemetry
