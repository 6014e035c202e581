#include "server/rpc/call/call_counts.h"

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"

namespace vantage::rpc {
namespace {

constexpr absl::Duration kRetryCallAfter = absl::Seconds(1);

absl::Status Busy(int calls, const char* what) {
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "SERVER_BUSY",
                             absl::StrCat("the server has ", calls, " ", what, " under way"),
                             kRetryCallAfter);
}

}  // namespace

absl::Status CallCounts::Take(const std::optional<std::string>& tenant, bool stream, int most) {
  const int most_streams = most - most / 4;
  std::lock_guard<std::mutex> lock(mutex_);
  if (all_.calls >= most) return Busy(all_.calls, "calls");
  if (stream && all_.streams >= most_streams) return Busy(all_.streams, "streams");
  if (tenant.has_value()) {
    const auto known = by_tenant_.find(*tenant);
    const Count own = known == by_tenant_.end() ? Count() : known->second;
    if (own.calls >= most - all_.calls || (stream && own.streams >= most_streams - all_.streams)) {
      return contract::Retryable(
          absl::StatusCode::kResourceExhausted, "TENANT_BUSY",
          absl::StrCat("the tenant has ", own.calls, " calls under way, ", own.streams,
                       " of them streams, and the rest is for others: end some"),
          kRetryCallAfter);
    }
    Count& count = by_tenant_[*tenant];
    ++count.calls;
    count.streams += stream ? 1 : 0;
  }
  ++all_.calls;
  all_.streams += stream ? 1 : 0;
  return absl::OkStatus();
}

void CallCounts::GiveBack(const std::optional<std::string>& tenant, bool stream) {
  std::lock_guard<std::mutex> lock(mutex_);
  --all_.calls;
  all_.streams -= stream ? 1 : 0;
  if (!tenant.has_value()) return;
  const auto known = by_tenant_.find(*tenant);
  if (known == by_tenant_.end()) return;
  known->second.streams -= stream ? 1 : 0;
  if (--known->second.calls == 0) by_tenant_.erase(known);
}

int CallCounts::total() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return all_.calls;
}

}  // namespace vantage::rpc
