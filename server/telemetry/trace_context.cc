#include "server/telemetry/trace_context.h"

#include <algorithm>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::telemetry {
namespace {

constexpr size_t kHeader = 55;  // of version 00

bool IsHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

// All zeros mean none.
bool IsId(absl::string_view text) {
  return IsHex(text) && text.find_first_not_of('0') != absl::string_view::npos;
}

std::string RandomId() {
  thread_local std::mt19937_64 random(std::random_device{}());
  return absl::StrFormat("%016x", std::max<uint64_t>(1, random()));
}

}  // namespace

TraceContext TraceContext::From(absl::string_view header) {
  TraceContext context;
  context.span_id = RandomId();
  // A later version may go on after the flags; ff is none.
  const bool shaped =
      header.size() >= kHeader && header[2] == '-' && header[35] == '-' && header[52] == '-' &&
      IsHex(header.substr(0, 2)) && header.substr(0, 2) != "ff" &&
      (header.size() == kHeader || (header.substr(0, 2) != "00" && header[kHeader] == '-'));
  if (shaped && IsId(header.substr(3, 32)) && IsId(header.substr(36, 16)) &&
      IsHex(header.substr(53, 2))) {
    context.trace_id = std::string(header.substr(3, 32));
    context.parent_id = std::string(header.substr(36, 16));
    const char flags = header[54];
    context.sampled = ((flags <= '9' ? flags - '0' : flags - 'a' + 10) & 1) != 0;
  } else {
    context.trace_id = RandomId() + RandomId();
  }
  return context;
}

std::string TraceContext::ToHeader() const {
  return absl::StrCat("00-", trace_id, "-", span_id, sampled ? "-01" : "-00");
}

}  // namespace vantage::telemetry
