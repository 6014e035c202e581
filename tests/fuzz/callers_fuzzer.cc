#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "server/auth/callers.h"
#include "server/telemetry/trace_context.h"

// A callers file, a token and a trace header: refused or read, never a surprise.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const absl::string_view text(reinterpret_cast<const char*>(data), size);  // NOLINT: bytes
  const auto list = vantage::auth::CallerList::Parse(text);
  if (!list.ok() && !absl::IsInvalidArgument(list.status())) std::abort();
  if (list.ok() && list->ByToken(text) != nullptr) std::abort();
  if (vantage::telemetry::TraceContext::From(text).ToHeader().size() != 55) std::abort();
  return 0;
}
