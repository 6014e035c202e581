// The time that servers of the same data saw pass: what ages are counted by. It does not follow the
// wall clock, which may be wrong and jumps when that is noticed; nor does it grow while no server
// runs.
#ifndef VANTAGE_SERVER_EXECUTION_SEEN_TIME_H_
#define VANTAGE_SERVER_EXECUTION_SEEN_TIME_H_

#include <atomic>
#include <cstdint>
#include <functional>

#include "absl/time/time.h"

namespace vantage::execution {

// Time since some moment in the past, as a clock says that nobody sets.
absl::Duration SteadyTime();

// Thread safe.
class SeenTime {
 public:
  // Grows as time passes, from whatever it is.
  using Steady = std::function<absl::Duration()>;

  explicit SeenTime(Steady steady = SteadyTime);

  // Servers before this one had seen `before` pass. Never takes anything back.
  void Resume(absl::Duration before);
  // All that was seen until now, in whole milliseconds.
  absl::Duration Now() const;

 private:
  const Steady steady_;
  const absl::Duration start_;
  std::atomic<int64_t> before_{0};  // ms
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_SEEN_TIME_H_
