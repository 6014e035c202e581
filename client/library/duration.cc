#include "client/library/duration.h"

#include <cmath>
#include <cstdint>

namespace vantage::client {
namespace {

constexpr int64_t kNanos = 1'000'000'000;

}  // namespace

google::protobuf::Duration DurationOf(double seconds) {
  const double whole = std::trunc(seconds);
  const int64_t nanos = std::llround((seconds - whole) * static_cast<double>(kNanos));
  google::protobuf::Duration duration;
  duration.set_seconds(static_cast<int64_t>(whole) + nanos / kNanos);
  duration.set_nanos(static_cast<int32_t>(nanos % kNanos));
  return duration;
}

double SecondsOf(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

}  // namespace vantage::client
