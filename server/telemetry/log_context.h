// The trace that the current thread works for, so that every line of the log can name it.
#ifndef VANTAGE_SERVER_TELEMETRY_LOG_CONTEXT_H_
#define VANTAGE_SERVER_TELEMETRY_LOG_CONTEXT_H_

#include <memory>
#include <string>
#include <utility>

namespace vantage::telemetry {

// A value that work takes along to another thread. Null: no trace.
using LogContext = std::shared_ptr<const std::string>;

// The context of this thread.
LogContext CurrentLogContext();

// While this object lives, the thread works for its trace.
class ScopedLogContext {
 public:
  explicit ScopedLogContext(LogContext context);
  ~ScopedLogContext();
  ScopedLogContext(const ScopedLogContext&) = delete;
  ScopedLogContext& operator=(const ScopedLogContext&) = delete;

 private:
  LogContext before_;
};

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_LOG_CONTEXT_H_
