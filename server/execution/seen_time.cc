#include "server/execution/seen_time.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace vantage::execution {

absl::Duration SteadyTime() {
  return absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch());
}

SeenTime::SeenTime(Steady steady) : steady_(std::move(steady)), start_(steady_()) {}

void SeenTime::Resume(absl::Duration before) {
  const int64_t more = absl::ToInt64Milliseconds(before - Now());
  if (more > 0) before_ += more;
}

absl::Duration SeenTime::Now() const {
  const absl::Duration passed = std::max(steady_() - start_, absl::ZeroDuration());
  return absl::Milliseconds(before_ + absl::ToInt64Milliseconds(passed));
}

}  // namespace vantage::execution
