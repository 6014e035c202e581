// The client's request to which work belongs, as W3C's Trace Context carries it.
#ifndef VANTAGE_SERVER_TELEMETRY_TRACE_CONTEXT_H_
#define VANTAGE_SERVER_TELEMETRY_TRACE_CONTEXT_H_

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace vantage::telemetry {

struct TraceContext {
  std::string trace_id;   // 32 lower-case hexadecimal digits
  std::string span_id;    // 16, of this server's part
  std::string parent_id;  // 16, of the client's part; empty: the trace begins here
  bool sampled = false;

  // A part of the trace that `traceparent` names, with a span of its own; a new trace where that
  // is empty or malformed.
  static TraceContext From(absl::string_view traceparent);

  // The header's text: 00-{trace_id}-{span_id}-{flags}.
  std::string ToHeader() const;
};

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_TRACE_CONTEXT_H_
