#include "server/telemetry/log_context.h"

namespace vantage::telemetry {
namespace {
thread_local LogContext current;
}  // namespace

LogContext CurrentLogContext() { return current; }

ScopedLogContext::ScopedLogContext(LogContext context)
    : before_(std::exchange(current, std::move(context))) {}
ScopedLogContext::~ScopedLogContext() { current = std::move(before_); }

}  // namespace vantage::telemetry
